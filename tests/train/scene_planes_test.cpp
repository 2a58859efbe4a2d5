#include "train/scene_planes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <utility>

#include "config/heads.h"
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

/// Objects `first` to `first` + `count` - 1 of two, each seen twice, with a Gaussian pair for each pixel.
struct TwoViews : Batch {
    TwoViews(const model::ModelConfig& network, const TrainConfig& training, std::size_t first,
             std::size_t count)
        : Batch(network, training) {
        const auto twice = [&](std::vector<float>& values) {
            const std::vector<float> all = std::exchange(values, {});
            for (std::size_t i = first; i < first + count; ++i)
                for (int view = 0; view < 2; ++view)
                    values.insert(values.end(), part(all, i), part(all, i + 1));
        };
        const std::vector<float> wanted(part(targets, first), part(targets, first + count));
        targets = wanted;
        cameras.resize(count * training.targets);
        twice(images);
        twice(planes);
        poses.clear();
        quaternions.clear();
        for (std::size_t i = 0; i < count; ++i) {
            poses.insert(poses.end(), kIdentity, kIdentity + 16);
            poses.insert(poses.end(), kTurned, kTurned + 16);
            quaternions.insert(quaternions.end(), {1, 0, 0, 0, 0.7071068F, 0, 0.7071068F, 0});
        }
    }

  private:
    static std::vector<float>::const_iterator part(const std::vector<float>& all, std::size_t i) {
        return all.begin() + static_cast<std::ptrdiff_t>(i * all.size() / 2);
    }
};

/// Passes of one and of two objects, and each object alone, give one loss: each has its own planes.
TEST_P(TrainerPlanes, AnObjectHasItsOwnPlanes) {
    network_.views = 2;
    network_.per_pixel = 2;
    network_.resolution = 6;  // no object but the first begins where bindings can
    network_.attention_resolutions = {3};
    const auto loss_of = [&](std::size_t first, std::size_t count, std::uint32_t pass) {
        const TwoViews batch(network_, training_, first, count);
        TrainConfig training = training_;
        training.batch_size = static_cast<std::uint32_t>(count);
        training.micro_batch = pass;
        const auto trainer = make(network_, training);
        const double plane = run(*trainer, batch).loss.of("plane");
        EXPECT_GT(plane, 0);
        return std::pair(plane, run(*trainer, batch).loss.total);
    };
    const auto one = loss_of(0, 2, 1), two = loss_of(0, 2, 2);
    const double alone[] = {loss_of(0, 1, 1).first, loss_of(1, 1, 1).first};
    EXPECT_GT(std::abs(alone[0] - alone[1]), 1e-3 * alone[0]);
    EXPECT_NEAR(one.first, (alone[0] + alone[1]) / 2, 1e-6 * one.first);
    EXPECT_NEAR(two.first, one.first, 1e-6 * one.first);
    EXPECT_NEAR(two.second, one.second, 1e-6 * one.second);  // after an update
}

/// LGM's Gaussians lie in a box, wherever it puts them.
TEST_P(TrainerPlanes, NetworksWithoutGaussiansOfPixelsAreRefused) {
    network_.positions = kHeadBox;
    EXPECT_ERROR(Trainer::create(context(), network_, training_), Code::kInvalidArgument,
                 "the network's Gaussians are not those of the pixels of its input");
}

TEST_P(TrainerPlanes, CyclesAreRefused) {
    config::take_head(config::kHeads[1], network_);
    network_.mask = true;
    training_.cycle_every = 1;
    EXPECT_ERROR(Trainer::create(context(), network_, training_), Code::kInvalidArgument,
                 "drawn views have no planes");
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
