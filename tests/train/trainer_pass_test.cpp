#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "ops/op_harness.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kObjects = 3;

/// What a pass did, and the same by a rasterizer and a loss that know one object.
class TrainerPass : public KernelsTest {
  protected:
    void prepare(std::uint32_t side, std::uint32_t targets) {
        network_ = small_network();
        network_.resolution = side;
        training_ = small_training();
        training_.batch_size = training_.micro_batch = kObjects;
        training_.targets = targets;
        training_.ssim_weight = 0.2;
        training_.edge_weight = 0.5;
        training_.edge_by_size = true;
        training_.white_background = false;
        desc_ = {};
        desc_.gaussians = network_.gaussians();
        desc_.views = targets;
        desc_.width = desc_.height = side;
        desc_.sh_degree = network_.sh_degree;
        desc_.backward = true;
    }
    std::vector<float> numbers(const gaussians::SetViews& set) {
        std::vector<float> all = download(context(), set.gaussians, desc_.gaussians * 12);
        const std::vector<float> colors =
            download(context(), set.colors, desc_.gaussians * desc_.color_floats());
        all.insert(all.end(), colors.begin(), colors.end());
        return all;
    }
    /// Draw and compare each object of the trainer's latest pass alone; expect its gradients.
    void expect_each_alone(Trainer& trainer, const Batch& batch, const train::TrainStep& step) {
        const auto rasterizer = need(raster::Rasterizer::create(context(), desc_));
        const vk::Buffer gradient = device_buffer(context(), 4 * desc_.pixels());
        const vk::Buffer no_depth = device_buffer(context(), 4);
        train::RenderLossDesc of_loss;
        of_loss.views = desc_.views;
        of_loss.height = of_loss.width = desc_.height;
        of_loss.image = rasterizer->workspace().image.range();
        of_loss.grad_image = gradient.range();
        of_loss.config = training_;
        of_loss.pixel_weights = true;
        auto loss = need(train::RenderLoss::create(context(), of_loss));
        auto sizes = need(train::SizeMap::create(context(), desc_));
        const auto slopes = need(gaussians::allocate_set(context(), desc_));
        std::uint64_t pairs = 0, visible = 0;
        double total = 0;
        const std::span<const float> targets = batch.targets;
        for (std::uint32_t object = 0; object < kObjects; ++object) {
            const std::vector<float> set = numbers(trainer.model().set(object));
            const std::size_t split = std::size_t{desc_.gaussians} * 12;
            const gaussians::GaussianSet scene = need(gaussians::allocate_set(context(), desc_));
            ASSERT_OK(context().write(scene.gaussians.range(), set.data(), 4 * split));
            ASSERT_OK(context().write(scene.colors.range(), set.data() + split,
                                      4 * (set.size() - split)));
            const auto cameras = std::span<const scene::Camera>(batch.cameras)
                                     .subspan(object * desc_.views, desc_.views);
            const auto views = need(raster::pack_views(desc_, cameras, {}));
            ASSERT_OK(rasterizer->forward(scene.views(), views));
            ASSERT_OK(sizes.draw(scene.views(), cameras, loss.pixel_weights()));
            const std::size_t each = targets.size() / kObjects;
            ASSERT_OK(loss.set_targets(targets.subspan(object * each, each)));
            ASSERT_OK(loss.run(0, 1.0F / kObjects, 0));
            const std::vector<float> losses =
                download(context(), loss.losses(), loss.losses().bytes / sizeof(float));
            total += static_cast<double>(1.0F / kObjects) * loss.terms_of(losses, 0).total;
            ASSERT_OK(rasterizer->backward(gradient.range(), no_depth.range(), slopes.views()));
            pairs += rasterizer->stats().pairs;
            visible += rasterizer->stats().visible;
            const std::vector<float> expected = numbers(slopes.views());
            EXPECT_TRUE(numbers(trainer.model().set(object, true)) == expected) << object;
            EXPECT_NE(expected, std::vector<float>(expected.size()));
        }
        EXPECT_EQ(step.loss.total, total);
        EXPECT_EQ(step.pairs, pairs);
        EXPECT_EQ(step.visible, visible);
        EXPECT_EQ(step.visible + step.culled, kObjects * desc_.items());
    }

    model::ModelConfig network_;
    TrainConfig training_;
    raster::RasterDesc desc_;  ///< one object's
};
SPLAT_INSTANTIATE_KERNELS(TrainerPass);

/// One call for all objects, with levels for targets; one for each, with floats, where their images begin at places
/// that bindings do not take (6 x 6 pixels). Gradients of each are those of the object alone, to the bit.
TEST_P(TrainerPass, GivesEachObjectWhatItGetsAlone) {
    for (const auto& [side, targets] : {std::pair{8U, 2U}, {6U, 1U}}) {
        SCOPED_TRACE(side);
        prepare(side, targets);
        Batch batch(network_, training_);
        std::vector<std::uint8_t> levels;
        for (float& target : batch.targets) {
            levels.push_back(static_cast<std::uint8_t>(std::clamp(255 * target, 0.0F, 255.0F)));
            target = static_cast<float>(levels.back()) / 255.0F;
        }
        const auto trainer = need(Trainer::create(context(), network_, training_));
        ASSERT_OK(trainer->model().init(7));
        train::TrainBatch given = batch.view();
        if (side == 8) given.levels = levels;
        train::TrainStep step;
        ASSERT_OK(trainer->step(given, step));
        expect_each_alone(*trainer, batch, step);
    }
}

}  // namespace
}  // namespace splat::test
