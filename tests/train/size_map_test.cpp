#include "train/size_map.h"

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_env.h"

namespace splat::train {
namespace {

constexpr std::uint32_t kSide = 64;

/// Two balls before a camera that looks along z, at x = -1 and x = 1.
class SizeMapTest : public testing::Test {
  protected:
    void SetUp() override {
        ASSERT_NE(context_, nullptr);
        desc_.gaussians = 2;
        desc_.width = desc_.height = kSide;
        auto packed = need(gaussians::allocate_set(*context_, desc_));
        packed_ = std::move(packed);
        scales_ = allocate(6);
        weights_ = allocate(4 * kSide * kSide);
    }
    vk::Buffer allocate(std::uint64_t floats) {
        return need(context_->memory().allocate(4 * floats, vk::MemoryKind::kDevice, "test"));
    }
    /// The weights [H,W] for balls of these radii at the distance `z`.
    std::vector<float> draw(float left, float right, float z) {
        const float balls[] = {-1, 0, z, 0.5F, left,  left,  left,  0, 1, 0, 0, 0,
                               1,  0, z, 0.5F, right, right, right, 0, 1, 0, 0, 0};
        EXPECT_OK(context_->write(packed_.gaussians.range(), balls, sizeof balls));
        // A Gaussian is as large as its longest axis.
        const float scales[] = {left, left / 2, left / 4, right / 4, right / 2, right};
        EXPECT_OK(context_->write(scales_.range(), scales, sizeof scales));
        const scene::Camera camera{
            "", kSide, kSide, 64, 64, 32.5, 32.5, {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
        auto map = need(SizeMap::create(*context_, desc_));
        EXPECT_OK(map.draw(packed_.views(), std::span(&camera, 1), weights_.range()));
        std::vector<float> quads(std::size_t{4} * kSide * kSide), weights;
        EXPECT_OK(context_->read(weights_.range(), quads.data(), 4 * quads.size()));
        for (std::size_t i = 0; i < quads.size(); i += 4) weights.push_back(quads[i]);
        return weights;
    }

    vk::Context* const context_ = test::shared_context();
    raster::RasterDesc desc_;
    gaussians::GaussianSet packed_;
    vk::Buffer scales_, weights_;
};

/// At its centre each ball has the same share of the pixel, so the weights are as the radii.
TEST_F(SizeMapTest, WeighsBySize) {
    const std::vector<float> weights = draw(0.2F, 0.4F, 4);
    const float left = weights[32 * kSide + 16], right = weights[32 * kSide + 48];
    EXPECT_NEAR(right / left, 2, 1e-5);
    double sum = 0;
    for (const float weight : weights) sum += static_cast<double>(weight);
    EXPECT_NEAR(sum / (kSide * kSide), 1, 1e-5);
    EXPECT_EQ(weights[0], 0) << "nothing is there";
}

TEST_F(SizeMapTest, IsOneWhereNothingIsDrawn) {
    for (const float weight : draw(0.2F, 0.4F, -4)) ASSERT_EQ(weight, 1);
}

}  // namespace
}  // namespace splat::train
