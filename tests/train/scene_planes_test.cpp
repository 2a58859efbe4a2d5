#include "train/scene_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "train/trainer_fixture.h"

namespace splat::test {
namespace {

constexpr float kIdentity[] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
/// A camera that is turned to the right by 90 degrees: its z is the first one's x.
constexpr float kTurned[] = {0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 3, 4, 5, 1};

/// A view of 2 x 2 pixels of one normal, with these ids.
std::vector<float> view_of(std::initializer_list<float> ids, std::array<float, 3> normal) {
    std::vector<float> channels;
    for (const float n : normal) channels.insert(channels.end(), 4, (n + 1) / 2);
    channels.insert(channels.end(), 4, 1.0F);
    channels.insert(channels.end(), ids);
    return channels;
}

TEST(PlaneMembers, PixelsOfAnIdArePlanes) {
    std::vector<float> channels = view_of({1, 0, 0.5F, 1}, {0, 0, -1});
    const std::vector<float> second = view_of({0, 0, 0.5F, 0}, {0, 0, -2});
    channels.insert(channels.end(), second.begin(), second.end());
    std::vector<float> poses(kIdentity, kIdentity + 16);
    poses.insert(poses.end(), kTurned, kTurned + 16);
    const train::PlaneMembers made = need(train::plane_members(channels, poses, 4, 1));
    EXPECT_EQ(made.members, (std::vector<std::uint32_t>{0, 3, 2, 6}));
    EXPECT_EQ(made.begins, (std::vector<std::uint32_t>{0, 2, 3, 4}));
    EXPECT_EQ(made.normals, (std::vector<float>{0, 0, -1, 0, 0, 0, -1, 0, -1, 0, 0, 0}));
    const train::PlaneMembers twice = need(train::plane_members(channels, poses, 4, 2));
    EXPECT_EQ(twice.members, (std::vector<std::uint32_t>{0, 1, 6, 7, 4, 5, 12, 13}));
    EXPECT_EQ(need(train::plane_members(view_of({0, 0, 0, 0}, {}), poses, 4, 1)).begins,
              std::vector<std::uint32_t>{0});
}

TEST(PlaneMembers, BadChannelsAreRefused) {
    std::vector<float> channels = view_of({0, 0, 0.5F, 1}, {0, 0, -0.25F});
    EXPECT_ERROR(train::plane_members(channels, kIdentity, 4, 1), Code::kInvalidArgument,
                 "planes of input view 0: pixel 2 is on a plane whose normal has the length 0.25");
    channels[5] = std::numeric_limits<float>::infinity();
    EXPECT_ERROR(train::plane_members(channels, kIdentity, 4, 1), Code::kInvalidArgument,
                 "planes of input view 0: channel 1 of pixel 1 is inf");
    constexpr std::size_t kSide = 16;
    std::vector<float> many(5 * kSide * kSide, 1);
    for (std::size_t i = 0; i < kSide * kSide; ++i)
        many[4 * kSide * kSide + i] = static_cast<float>(i + 1);
    EXPECT_ERROR(train::plane_members(many, kIdentity, kSide * kSide, 1), Code::kInvalidArgument,
                 "pixel 255 begins plane 256, expected at most 255 planes");
}

class TrainerPlanes : public TrainerTest {
  protected:
    TrainerPlanes() { training_.plane_weight = 20; }
    model::ModelConfig network_ = small_network();
    TrainConfig training_ = small_training();
};
INSTANTIATE_TEST_SUITE_P(Kernels, TrainerPlanes, testing::ValuesIn(kernels_to_test()),
                         kernels_test_name);

TEST_P(TrainerPlanes, GaussiansComeToTheirPlanes) {
    const auto trainer = make(network_, training_);
    const Batch batch(network_, training_);
    const TrainStep first = run(*trainer, batch);
    EXPECT_GT(first.loss.of("plane"), 0);
    EXPECT_NEAR(first.loss.total, first.loss.pixel + 20 * first.loss.of("plane"), 1e-9);
    TrainStep last;
    for (int i = 0; i < 15; ++i) last = run(*trainer, batch);
    EXPECT_LT(last.loss.of("plane"), 0.8 * first.loss.of("plane"));
}

/// Passes of one and of two objects, of two Gaussians a pixel and two views: one loss.
TEST_P(TrainerPlanes, PassesAgree) {
    network_.views = 2;
    network_.per_pixel = 2;
    double one = 0;
    for (const std::uint32_t objects : {1U, 2U}) {
        training_.micro_batch = objects;
        const auto trainer = make(network_, training_);
        Batch batch(network_, training_);
        const std::vector<float> images = batch.images, poses = batch.poses,
                                 quaternions = batch.quaternions, planes = batch.planes;
        batch.images.clear();
        batch.poses.clear();
        batch.quaternions.clear();
        batch.planes.clear();
        const auto twice = [](std::vector<float>& to, const std::vector<float>& from) {
            for (std::size_t i = 0; i < 2; ++i)
                for (int view = 0; view < 2; ++view)
                    to.insert(
                        to.end(), from.begin() + static_cast<std::ptrdiff_t>(i * from.size() / 2),
                        from.begin() + static_cast<std::ptrdiff_t>((i + 1) * from.size() / 2));
        };
        twice(batch.images, images);
        twice(batch.poses, poses);
        twice(batch.quaternions, quaternions);
        twice(batch.planes, planes);
        const TrainStep step = run(*trainer, batch);
        const TrainStep next = run(*trainer, batch);
        EXPECT_GT(step.loss.of("plane"), 0);
        if (objects == 1) one = next.loss.total;
        EXPECT_NEAR(next.loss.total, one, 1e-6 * one) << objects;
    }
}

TEST_P(TrainerPlanes, WhatDoesNotFitIsRefused) {
    const auto trainer = make(network_, training_);
    Batch batch(network_, training_);
    TrainStep step;
    const std::vector<float> planes = std::exchange(batch.planes, {});
    EXPECT_ERROR(trainer->step(batch.view(), step), Code::kShape,
                 "planes has 0 numbers, expected 640");
    batch.planes = planes;
    batch.planes[4 * 64 + 1] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(trainer->step(batch.view(), step), Code::kInvalidArgument,
                 "planes of input view 0");
    training_.plane_weight = 0;
    EXPECT_ERROR(make(network_, training_)->step(batch.view(), step), Code::kShape,
                 "planes has 640 numbers, expected 0");
}

}  // namespace
}  // namespace splat::test
