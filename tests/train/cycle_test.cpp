#include <cmath>

#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

/// With the inputs of F3D-Gaus.
model::ModelConfig depth_network() {
    model::ModelConfig network = small_network();
    network.positions = kHeadInputDepth;
    network.mask = true;
    return network;
}

TrainConfig cycle_training(std::uint64_t every, std::uint64_t after = 0) {
    TrainConfig training = small_training();
    training.cycle_every = every;
    training.cycle_after = after;
    return training;
}

class TrainerCycle : public TrainerTest {
  protected:
    /// Losses of steps on one batch, whose depths are 1.3.
    std::vector<double> losses(const TrainConfig& training, int steps,
                               std::vector<float>* bias = nullptr) {
        const model::ModelConfig network = depth_network();
        Batch batch(network, training);
        for (std::size_t i = 0; i < batch.images.size(); ++i) {
            const std::size_t plane = i / 64 % network.input_channels();
            if (plane >= 3) batch.images[i] = plane == 3 ? 1 : 1.3F;
        }
        const auto trainer = make(network, training);
        std::vector<double> all;
        for (int i = 0; i < steps; ++i) {
            const TrainStep step = run(*trainer, batch);
            EXPECT_FALSE(step.skipped);
            EXPECT_GT(step.pairs, 0U);
            all.push_back(step.loss.total);
        }
        nn::Parameters& parameters = trainer->model().parameters();
        if (bias != nullptr) {
            EXPECT_OK(parameters.read(parameters.find(kBias)->value, *bias));
        }
        return all;
    }
};
SPLAT_INSTANTIATE_KERNELS(TrainerCycle);

/// The steps before the first cycle are those of a training without; the joined set then learns.
TEST_P(TrainerCycle, JoinsWhatIsPredictedAgain) {
    const std::vector<double> plain = losses(cycle_training(0), 6);
    std::vector<float> bias, again;
    const std::vector<double> cycles = losses(cycle_training(2, 2), 20, &bias);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(cycles[i], plain[i]) << "step " << i;
    EXPECT_NE(cycles[3], plain[3]) << "the first that predicts again";
    EXPECT_LT(cycles[19], 0.95 * cycles[3]);
    EXPECT_LT(cycles[18], 0.95 * cycles[2]);
    EXPECT_EQ(losses(cycle_training(2, 2), 20, &again), cycles);
    EXPECT_EQ(again, bias) << "the same bits";
}

/// The loss that is told has no weight; the update has.
TEST_P(TrainerCycle, WeighsItsGradients) {
    TrainConfig light = cycle_training(1);
    light.cycle_weight = 0.25;
    light.eps = 1;  // steps are then as large as gradients
    TrainConfig full = light;
    full.cycle_weight = 1;
    std::vector<float> a, b;
    EXPECT_EQ(losses(light, 1, &a), losses(full, 1, &b));
    const auto start = need(model::Model::create(context(), depth_network(), {}));
    EXPECT_OK(start->init(7));
    std::vector<float> bias;
    EXPECT_OK(start->parameters().read(start->parameters().find(kBias)->value, bias));
    double moved[2] = {};
    for (std::size_t i = 0; i < bias.size(); ++i) {
        moved[0] += std::abs(static_cast<double>(a[i] - bias[i]));
        moved[1] += std::abs(static_cast<double>(b[i] - bias[i]));
    }
    ASSERT_GT(moved[1], 0);
    EXPECT_NEAR(moved[0] / moved[1], 0.25, 0.02);
}

TEST_P(TrainerCycle, RefusesWhatHasNoDrawnViews) {
    const auto refused = [&](const model::ModelConfig& network, const TrainConfig& training,
                             const char* part) {
        EXPECT_ERROR(Trainer::create(context(), network, training), Code::kInvalidArgument, part);
    };
    refused(small_network(), cycle_training(2),
            "'opt.cycle.every' is 2, but the network does not take one picture of colours and "
            "mask, and depths for its head");
    TrainConfig one = cycle_training(2);
    one.targets = 1;
    refused(depth_network(), one, "opt.imgs_per_obj is 1, the input view alone: expected 0");
    TrainConfig scales = cycle_training(2);
    scales.scale_terms = true;
    refused(depth_network(), scales, "opt.scale_terms is true");
}

}  // namespace
}  // namespace splat::test
