#include <filesystem>
#include <limits>

#include "config/heads.h"
#include "model/lpips_weights.h"
#include "support/gpu_buffers.h"
#include "support/parsed_json.h"
#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

class TrainerRules : public TrainerTest {
  protected:
    std::vector<float> gradient(Trainer& trainer, const char* name) {
        std::vector<float> values;
        const nn::Parameter* parameter = trainer.model().parameters().find(name);
        EXPECT_NE(parameter, nullptr);
        if (parameter == nullptr) return values;
        EXPECT_OK(trainer.model().parameters().read(parameter->grad, values));
        return values;
    }
    void expect_gradient_of_the_loss(const model::ModelConfig& network, TrainConfig training) {
        SCOPED_TRACE(format("pixel loss %d", static_cast<int>(training.pixel_loss)));
        training.learning_rate = 0;
        const auto trainer = make(network, training);
        const Batch batch(network, training);
        run(*trainer, batch);
        const std::vector<float> expected = gradient(*trainer, kBias);
        nn::Parameters& parameters = trainer->model().parameters();
        const nn::Parameter& bias = *parameters.find(kBias);
        std::vector<float> values;
        ASSERT_OK(parameters.read(bias.value, values));
        double largest = 0;
        for (const float g : expected)
            largest = std::max(largest, std::abs(static_cast<double>(g)));
        ASSERT_GT(largest, 1e-4);
        for (const std::size_t i : {0, 1, 4, 5, 12}) {
            const float kept = values[i];
            constexpr float kStep = 4e-3F;  // step of logits and logarithms
            double losses[2] = {};
            for (const int side : {0, 1}) {
                values[i] = kept + (side == 0 ? -kStep : kStep);
                ASSERT_OK(parameters.write(bias, values));
                losses[side] = run(*trainer, batch).loss.total;
            }
            values[i] = kept;
            ASSERT_OK(parameters.write(bias, values));
            const double difference = (losses[1] - losses[0]) / (2.0 * static_cast<double>(kStep));
            // The float32 loss is good to 1e-6 of its size of about 0.3, which the step turns into
            // 4e-5; pixels that Gaussians enter and leave (alpha 1/255) add as much.
            EXPECT_NEAR(difference, expected[i], 2e-4 + 0.02 * largest) << "bias " << i;
        }
    }
};
SPLAT_INSTANTIATE_KERNELS(TrainerRules);

/// Under the fast kernels alone: a network of 15 million weights, whose operators have tests under all.
class TrainerLpips : public TrainerRules {};
INSTANTIATE_TEST_SUITE_P(Kernels, TrainerLpips, testing::Values(vk::Kernels::kCpu),
                         kernels_test_name);

TEST_P(TrainerRules, LearnsABatchByHeart) {
    TrainConfig training = small_training();
    training.ssim_weight = 0.2;
    const auto trainer = make(small_network(), training);
    const Batch batch(small_network(), training);
    const TrainStep first = run(*trainer, batch);
    TrainStep last;
    for (int i = 0; i < 20; ++i) last = run(*trainer, batch);
    EXPECT_FALSE(last.skipped);
    EXPECT_EQ(last.step, 21U);
    EXPECT_GT(first.pairs, 0U);
    EXPECT_LT(last.loss.total, 0.8 * first.loss.total);
    EXPECT_NEAR(last.loss.total, 0.8 * last.loss.pixel + 0.2 * (1 - last.loss.of("ssim")), 1e-12);
    EXPECT_EQ(last.loss.pixel, last.loss.squared);
}

/// Every head of model.head, and one more, whose row is all that it takes.
TEST_P(TrainerRules, HeadsLearnABatchByHeart) {
    std::vector<config::Head> heads(std::begin(config::kHeads), std::end(config::kHeads));
    heads.push_back({"mine",
                     {.positions = kHeadInputDepth, .scales = kHeadSoftplus, .per_pixel = 2},
                     {1, 0},
                     {0.01F, 0},
                     {1, 0},
                     {0.1F, 0.05F},
                     0});
    const TrainConfig training = small_training();
    for (const config::Head& head : heads) {
        SCOPED_TRACE(head.name);
        model::ModelConfig network = small_network();
        const config::HeadInit opacity = network.init_opacity, scale = network.init_scale;
        config::take_head(head, network);
        network.init_opacity = opacity;
        network.init_scale = scale;
        network.box = 0.5;
        Batch batch(network, training);
        const std::size_t pixels = 64, planes = network.input_channels();
        for (std::size_t i = 0; i < batch.images.size(); ++i)
            if (network.positions == kHeadInputDepth && i / pixels % planes == planes - 1)
                batch.images[i] = 1.3F;
        for (scene::Camera& camera : batch.cameras)  // the box is around the origin
            camera.world_to_camera[11] = network.positions == kHeadBox ? 1.3 : 0;
        const auto trainer = make(network, training);
        EXPECT_EQ(trainer->model().set_desc().gaussians, 64 * head.form.per_pixel);
        const TrainStep first = run(*trainer, batch);
        TrainStep last;
        for (int i = 0; i < 15; ++i) last = run(*trainer, batch);
        EXPECT_FALSE(last.skipped);
        EXPECT_GT(first.pairs, 0U);
        EXPECT_LT(last.loss.total, 0.9 * first.loss.total);
    }
}

/// The gradient of the whole chain against central differences, for those parameters that every
/// Gaussian shares: colours, opacity, size, depth and offset.
TEST_P(TrainerRules, GradientIsThatOfTheLoss) {
    for (const config::PixelLoss kind : {config::PixelLoss::kL2, config::PixelLoss::kL1}) {
        TrainConfig training = small_training();
        training.pixel_loss = kind;
        training.ssim_weight = kind == config::PixelLoss::kL1 ? 0.3 : 0;
        expect_gradient_of_the_loss(small_network(), training);
    }
    for (const config::LossTerm& term : config::kLossTerms) {
        if (term.is_lpips()) continue;
        SCOPED_TRACE(term.name);
        TrainConfig training = small_training();
        training.*term.weight = term.op == nullptr ? 20 : 0.5;
        training.edge_filter = config::EdgeFilter::kScharr;
        expect_gradient_of_the_loss(small_network(), training);
    }
}

/// The weights have the mean 1, so they move the term between pixels and keep its size.
TEST_P(TrainerRules, EdgesAreWeighedBySize) {
    TrainConfig training = small_training();
    training.edge_weight = 0.5;
    double edges[2] = {};
    for (const bool by_size : {false, true}) {
        training.edge_by_size = by_size;
        const auto trainer = make(small_network(), training);
        const Batch batch(small_network(), training);
        const TrainStep first = run(*trainer, batch);
        EXPECT_NEAR(first.loss.total, first.loss.pixel + 0.5 * first.loss.of("edge"), 1e-12);
        edges[by_size ? 1 : 0] = first.loss.of("edge");
        TrainStep last;
        for (int i = 0; i < 20; ++i) last = run(*trainer, batch);
        EXPECT_LT(last.loss.of("edge"), 0.95 * first.loss.of("edge"));
    }
    EXPECT_NE(edges[0], edges[1]);
    EXPECT_GT(edges[1], 0.1 * edges[0]);
    EXPECT_LT(edges[1], 10 * edges[0]);
}

/// LPIPS takes part from its step on, value and gradient, with weights of its own files.
TEST_P(TrainerLpips, TakesPart) {
    const std::string folder = testing::TempDir();
    TrainConfig training = small_training();
    training.lpips_weight = 0.5;
    training.lpips_after = 1;
    training.lpips_weights = save_lpips_weights(folder);
    model::ModelConfig network = small_network();
    network.resolution = 16;  // the least that VGG16 takes
    const auto trainer = make(network, training);
    const Batch batch(network, training);
    const TrainStep without = run(*trainer, batch);
    EXPECT_EQ(without.loss.of("lpips"), 0);
    EXPECT_EQ(without.loss.total, without.loss.pixel);
    const TrainStep with = run(*trainer, batch);
    EXPECT_GT(with.loss.of("lpips"), 0);
    EXPECT_NEAR(with.loss.total, 0.5 * with.loss.pixel + 0.5 * with.loss.of("lpips"), 1e-12);
    const auto later = make(network, training);
    for (int i = 0; i < 2; ++i) ASSERT_OK(later->step(batch.view()));
    EXPECT_EQ(later->results().size(), 1U) << "read to know whether LPIPS begins";
    ASSERT_OK(later->read());
    EXPECT_EQ(later->results()[0].loss.total, without.loss.total);
    EXPECT_EQ(later->results()[1].loss.total, with.loss.total);

    training.lpips_after = 0;
    training.micro_batch = 2;
    expect_gradient_of_the_loss(network, training);
    std::filesystem::remove(training.lpips_weights[0]);
    training.lpips_weights = {folder + "/lpips.safetensors"};
    EXPECT_ERROR(Trainer::create(context(), network, training), Code::kInvalidArgument,
                 "features.0");
    std::filesystem::remove(training.lpips_weights[0]);
    training.lpips_weights.clear();
    EXPECT_ERROR(Trainer::create(context(), network, training), Code::kInvalidArgument,
                 "'opt.lpips_weights' names no files");
}

TEST_P(TrainerRules, PassesOfAnySizeGiveTheSameGradient) {
    TrainConfig one = small_training();
    TrainConfig two = small_training();
    two.micro_batch = 2;
    const auto single = make(small_network(), one);
    const auto pair = make(small_network(), two);
    const Batch batch(small_network(), one);
    const TrainStep a = run(*single, batch);
    const TrainStep b = run(*pair, batch);
    EXPECT_NEAR(a.loss.total, b.loss.total, 1e-6 * a.loss.total);
    const std::vector<float> ga = gradient(*single, kBias);
    const std::vector<float> gb = gradient(*pair, kBias);
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < ga.size(); ++i) {
        difference += std::pow(static_cast<double>(ga[i]) - static_cast<double>(gb[i]), 2);
        norm += std::pow(static_cast<double>(gb[i]), 2);
    }
    EXPECT_LE(std::sqrt(difference / norm), 1e-4) << "sums of a larger pass are tiled otherwise";
}

/// What others see of a step's gradients is what the set holds, with rows made after the step and before it.
TEST_P(TrainerRules, RowsOfGradientsAreThoseOfTheSet) {
    for (const std::uint32_t objects : {1U, 2U}) {
        TrainConfig training = small_training();
        training.micro_batch = objects;
        const auto trainer = make(small_network(), training);
        for (const std::uint64_t seed : {3U, 4U}) {
            run(*trainer, Batch(small_network(), training, seed));
            const gaussians::SetViews set = trainer->model().sets(true);
            const std::vector<float> quads = download(context(), set.gaussians, 12 * set.count);
            const auto r = trainer->model().output_gradients().value();
            std::vector<float> packed(quads.size());
            const std::tuple<vk::BufferView, std::size_t, std::size_t> parts[] = {
                {r.means, 3, 0}, {r.opacities, 1, 3}, {r.scales, 3, 4}, {r.rotations, 4, 8}};
            for (const auto& [view, width, at] : parts) {
                const std::vector<float> values = download(context(), view, width * set.count);
                for (std::size_t i = 0; i < values.size(); ++i)
                    packed[i / width * 12 + at + i % width] = values[i];
            }
            EXPECT_TRUE(packed == quads && quads != std::vector<float>(quads.size()));
            EXPECT_EQ(download(context(), r.sh, 12 * set.count),
                      download(context(), set.colors, 12 * set.count));
        }
    }
}

/// CO3D's terms, means over the outliers of the batch: one object has more of them than the other.
TEST_P(TrainerRules, ScaleTermsAreMeansOverTheBatch) {
    model::ModelConfig network = small_network();
    network.init_scale = {1, 20};
    TrainConfig training = small_training();
    training.scale_terms = true;
    const auto single = make(network, training);
    training.micro_batch = 2;
    const auto pair = make(network, training);
    training.scale_terms = false;
    const auto without = make(network, training);
    Batch batch(network, training);
    std::fill(batch.images.begin(),
              batch.images.begin() + static_cast<std::ptrdiff_t>(batch.images.size() / 2), 0.5F);
    const double loss = run(*single, batch).loss.total, loss_of_pair = run(*pair, batch).loss.total;
    const double loss_without = run(*without, batch).loss.total;
    std::vector<float> scales;
    ASSERT_OK(pair->model().parameters().read(pair->model().outputs().value().scales, scales));
    std::size_t large[2] = {};
    for (std::size_t i = 0; i < scales.size(); ++i)
        large[2 * i / scales.size()] += scales[i] > 20 ? 1 : 0;
    ASSERT_GT(std::min(large[0], large[1]), 0U);
    ASSERT_GT(std::max(large[0], large[1]),
              1.1 * static_cast<double>(std::min(large[0], large[1])));
    const std::vector<float> ga = gradient(*single, kBias);
    const std::vector<float> gb = gradient(*pair, kBias);
    const std::vector<float> plain = gradient(*without, kBias);
    double difference = 0, norm = 0, of_terms = 0;
    for (std::size_t i = 0; i < ga.size(); ++i) {
        difference += std::pow(static_cast<double>(ga[i]) - static_cast<double>(gb[i]), 2);
        norm += std::pow(static_cast<double>(gb[i]), 2);
        of_terms += static_cast<double>(gb[i]) - static_cast<double>(plain[i]);
    }
    EXPECT_LE(std::sqrt(difference / norm), 1e-4);
    // Scales are exp(x): the sum over their biases of d/dx 0.1 mean(s) is 0.1 mean(s).
    double mean = 0;
    for (const float s : scales) mean += s > 20 ? static_cast<double>(s) : 0;
    mean /= static_cast<double>(large[0] + large[1]);
    EXPECT_NEAR(of_terms, 0.1 * mean, 1e-3 * mean);
    EXPECT_NEAR(loss - loss_without, 0.1 * mean, 1e-5 * mean);
    EXPECT_NEAR(loss, loss_of_pair, 1e-6 * loss);
}

/// Activations that are computed once more have the same bits, dropout included, and need less memory.
TEST_P(TrainerRules, RecomputesToTheSameBits) {
    model::ModelConfig network = small_network();
    network.dropout = 0.1F;
    TrainConfig training = small_training();
    const auto kept = make(network, training);
    training.recompute = true;
    const auto again = make(network, training);
    EXPECT_LT(again->model().executor().memory().bound, kept->model().executor().memory().bound);
    const Batch batch(network, training);
    EXPECT_EQ(run(*again, batch).loss.total, run(*kept, batch).loss.total);
    EXPECT_EQ(again->steps(), 1U);
    for (const nn::Parameter& parameter : kept->model().parameters().all()) {
        std::vector<float> one, other;
        ASSERT_OK(kept->model().parameters().read(parameter.value, one));
        const nn::Parameter* same = again->model().parameters().find(parameter.name);
        ASSERT_NE(same, nullptr);
        ASSERT_OK(again->model().parameters().read(same->value, other));
        EXPECT_EQ(one, other) << parameter.name;
    }
}

TEST_P(TrainerRules, ResumesBitByBit) {
    model::ModelConfig network = small_network();
    network.dropout = 0.1F;
    const TrainConfig training = small_training();
    const auto whole = make(network, training);
    const auto first = make(network, training);
    const auto batch = [&](std::uint64_t i) { return Batch(network, training, 100 + i); };
    for (std::uint64_t i = 0; i < 3; ++i) run(*first, batch(i));
    const auto file = need(first->checkpoint());
    const auto second = make(network, training);
    run(*second, batch(50));  // whatever it did before is gone
    ASSERT_OK(second->resume(file));
    EXPECT_EQ(second->steps(), 3U);
    for (std::uint64_t i = 0; i < 6; ++i) run(*whole, batch(i));
    for (std::uint64_t i = 3; i < 6; ++i) run(*second, batch(i));
    const auto expected = need(whole->checkpoint());
    const auto got = need(second->checkpoint());
    EXPECT_EQ(expected.metadata, got.metadata);
    const auto average = need(whole->averaged_state());
    const io::NamedTensor* averaged = average.find(kBias);
    const io::NamedTensor* current = expected.tensors.find(kBias);
    ASSERT_TRUE(averaged != nullptr && current != nullptr);
    EXPECT_NE(averaged->values, current->values);
    EXPECT_EQ(averaged->values, expected.tensors.find(std::string("ema:") + kBias)->values);
    for (const io::NamedTensor& tensor : expected.tensors) {
        const io::NamedTensor* other = got.tensors.find(tensor.name);
        ASSERT_NE(other, nullptr);
        EXPECT_EQ(tensor.values, other->values) << tensor.name;
    }
}

TEST_P(TrainerRules, RefusesAStepWithoutAPlace) {
    TrainConfig training = small_training();
    training.schedule = config::Schedule::kStep;
    EXPECT_ERROR(Trainer::create(context(), small_network(), training), Code::kInvalidArgument,
                 "'opt.step_lr_at' is 0, expected at least 1");
}

TEST_P(TrainerRules, RefusesADamagedOrForeignState) {
    const auto trainer = make(small_network(), small_training());
    auto file = need(trainer->checkpoint());
    model::ModelConfig other = small_network();
    other.base_dim = 16;
    const auto wider = make(other, small_training());
    EXPECT_ERROR(wider->resume(file), Code::kInvalidArgument, "of another configuration");
    for (auto& [key, text] : file.metadata)
        if (key == "crc32") text = "1";
    EXPECT_ERROR(trainer->resume(file), Code::kFormat, "the file is damaged");
    file.metadata.clear();
    EXPECT_ERROR(trainer->resume(file), Code::kFormat, "is not a training state");
}

TEST_P(TrainerRules, SkipsAStepThatIsNotFinite) {
    const auto trainer = make(small_network(), small_training());
    const Batch batch(small_network(), small_training());
    run(*trainer, batch);
    nn::Parameters& parameters = trainer->model().parameters();
    const nn::Parameter& bias = *parameters.find(kBias);
    std::vector<float> good;
    ASSERT_OK(parameters.read(bias.value, good));
    std::vector<float> bad = good;
    bad[1] = std::numeric_limits<float>::quiet_NaN();  // an offset
    ASSERT_OK(parameters.write(bias, bad));
    const TrainStep step = run(*trainer, batch);
    EXPECT_TRUE(step.skipped);
    EXPECT_EQ(step.step, 1U);
    ASSERT_OK(parameters.write(bias, good));
    EXPECT_FALSE(run(*trainer, batch).skipped);
    EXPECT_EQ(trainer->steps(), 2U);
}

PFN_vkCreateShaderModule g_load;

/// The driver's, without memory for the shader that updates averages.
VKAPI_ATTR VkResult VKAPI_CALL load_without_averages(VkDevice device,
                                                     const VkShaderModuleCreateInfo* info,
                                                     const VkAllocationCallbacks* host,
                                                     VkShaderModule* module) {
    for (const char* name : {"ema", "ema_cpu"})
        if (const vk::ShaderModule* ema = vk::find_shader(name);
            ema != nullptr && info->pCode == ema->words.data())
            return VK_ERROR_OUT_OF_DEVICE_MEMORY;
    return g_load(device, info, host, module);
}

TEST_P(TrainerRules, UpdatesAllOrNothing) {
    const auto device = make_context(context_desc(GetParam()));
    auto& load = device->device().vk.vkCreateShaderModule;
    g_load = load;
    load = load_without_averages;
    auto made = need(Trainer::create(*device, small_network(), small_training()));
    Trainer& trainer = *made;
    ASSERT_OK(trainer.model().init(7));
    nn::Parameters& parameters = trainer.model().parameters();
    const nn::Parameter& bias = *parameters.find(kBias);
    std::vector<float> before, after, expected;
    ASSERT_OK(parameters.read(bias.value, before));
    const Batch batch(small_network(), small_training());
    TrainStep step;
    EXPECT_ERROR(trainer.step(batch.view(), step), Code::kOutOfDeviceMemory,
                 "vkCreateShaderModule");
    ASSERT_OK(parameters.read(bias.value, after));
    EXPECT_EQ(after, before);
    EXPECT_EQ(trainer.steps(), 0U);
    load = g_load;
    run(trainer, batch);
    EXPECT_EQ(trainer.steps(), 1U);
    ASSERT_OK(parameters.read(bias.value, after));
    const auto never_failed = make(small_network(), small_training());
    run(*never_failed, batch);
    nn::Parameters& others = never_failed->model().parameters();
    ASSERT_OK(others.read(others.find(kBias)->value, expected));
    EXPECT_NE(after, before);
    EXPECT_EQ(after, expected);
}

/// One up to the pictures, whose statistics the host reads, and one for gradients and the update.
TEST_P(TrainerRules, AStepIsFewLists) {
    vk::ContextDesc desc = context_desc(GetParam());
    desc.profile = true;
    const auto device = make_context(desc);
    TrainConfig training = small_training();
    training.batch_size = 4;
    training.micro_batch = 4;
    training.ssim_weight = 0.2;
    const auto trainer = need(Trainer::create(*device, small_network(), training));
    ASSERT_OK(trainer->model().init(7));
    const Batch batch(small_network(), training);
    for (int i = 0; i < 3; ++i) {
        device->profile()->reset();
        const TrainStep step = run(*trainer, batch);
        EXPECT_GT(std::min({step.network_seconds, step.render_seconds, step.update_seconds}), 0);
    }
    const Json profile = need(parse_json(device->profile()->json("x"), "profile"));
    EXPECT_EQ(profile["lists"]["count"], 2);
}

/// Short submits change no bit, and each is as short by its estimate.
TEST_P(TrainerRules, ShortSubmitsGiveTheSameBits) {
    std::vector<float> weights[2];
    TrainConfig training = small_training();
    training.ssim_weight = 0.2;
    const Batch batch(small_network(), training);
    for (const bool brief : {false, true}) {
        vk::ContextDesc desc = context_desc(GetParam());
        // A part of a list, of 256 entries, takes plain kernels 5.2 ms, by their estimate.
        const bool plain = GetParam() == vk::Kernels::kPlain;
        desc.device.max_submit_ns = !brief ? 0 : plain ? 6'000'000 : 1'000'000;
        const auto device = make_context(desc);
        const auto trainer = need(Trainer::create(*device, small_network(), training));
        ASSERT_OK(trainer->model().init(7));
        for (int i = 0; i < 2; ++i) run(*trainer, batch);
        for (const nn::Parameter& parameter : trainer->model().parameters().all()) {
            std::vector<float> values;
            ASSERT_OK(trainer->model().parameters().read(parameter.value, values));
            weights[brief].insert(weights[brief].end(), values.begin(), values.end());
        }
        const vk::Pace& pace = device->device().pace;
        if (!pace.watched()) {
            EXPECT_LE(pace.longest_estimate(), pace.submit_seconds());
        }
    }
    EXPECT_EQ(weights[1], weights[0]);
}

TEST_P(TrainerRules, RefusesABatchThatDoesNotFit) {
    const auto trainer = make(small_network(), small_training());
    Batch batch(small_network(), small_training());
    TrainStep step;
    batch.targets.pop_back();
    EXPECT_ERROR(trainer->step(batch.view(), step), Code::kShape, "targets has 767 numbers");
    batch.targets.push_back(std::numeric_limits<float>::infinity());
    EXPECT_ERROR(trainer->step(batch.view(), step), Code::kInvalidArgument, "targets hold inf");
    batch.targets.back() = 0;
    batch.cameras.pop_back();
    EXPECT_ERROR(trainer->step(batch.view(), step), Code::kShape, "3 cameras, expected 4");
    EXPECT_EQ(trainer->steps(), 0U);
}

}  // namespace
}  // namespace splat::test
