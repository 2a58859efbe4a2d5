#pragma once

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "train/trainer.h"

namespace splat::test {

using config::TrainConfig;
using train::TrainBatch;
using train::Trainer;
using train::TrainStep;

/// Two levels of 8 and 4 pixels, attention at 4.
inline model::ModelConfig small_network() {
    model::ModelConfig c;
    c.resolution = 8;
    c.base_dim = 8;
    c.num_blocks = 1;
    c.channel_mult = {1, 2};
    c.attention_resolutions = {4};
    c.dropout = 0;
    // Visible from the start, so that gradients have an ordinary size. Gaussians start at the centres
    // of pixels. With this scale they end (alpha 1/255) 2.45 pixels away, where no other centre is;
    // otherwise all of them would enter and leave pixels at the same time.
    c.init_opacity = {1, 0};
    c.init_scale = {0.1F, 0.09F};
    return c;
}

inline TrainConfig small_training() {
    TrainConfig c;
    c.batch_size = 2;
    c.targets = 2;
    c.learning_rate = 1e-3;
    c.ema_every = 1;
    c.ema_after = 2;
    c.ema_most = 0.9;
    return c;
}

/// Channels of planes: a third of the columns is on none, the next on one that faces the camera, the others on one that
/// leans; from image to image they move by a column.
inline std::vector<float> two_planes(std::size_t side, std::size_t images) {
    constexpr float kColumns[3][5] = {{}, {0.5F, 0.5F, 0, 1, 0.5F}, {0.8F, 0.5F, 0.1F, 0.7F, 1}};
    std::vector<float> channels;
    for (std::size_t i = 0; i < images * 5 * side * side; ++i)
        channels.push_back(kColumns[(i % side + i / (5 * side * side)) % 3][i / (side * side) % 5]);
    return channels;
}

/// Images of two objects seen from the front, and their targets a little from the sides.
struct Batch {
    Batch(const model::ModelConfig& network, const TrainConfig& training, std::uint64_t seed = 3) {
        const std::size_t pixels = std::size_t{network.resolution} * network.resolution;
        const std::size_t objects = training.batch_size;
        images = normal_fill(objects * network.input_channels() * pixels, seed, 0.5, 0.2);
        targets = normal_fill(objects * training.targets * 3 * pixels, seed + 1, 0.5, 0.2);
        if (training.plane_weight > 0) planes = two_planes(network.resolution, objects);
        for (std::size_t i = 0; i < objects; ++i) {
            const float pose[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
            poses.insert(poses.end(), pose, pose + 16);
            quaternions.insert(quaternions.end(), {1, 0, 0, 0});
            if (network.fov_degrees == 0)
                focals.insert(focals.end(), 2, 1.1F * static_cast<float>(network.resolution));
            if (network.origin_distance)  // the last plane of each image
                std::fill_n(images.end() -
                                static_cast<std::ptrdiff_t>(
                                    (objects - 1 - i) * network.input_channels() * pixels + pixels),
                            pixels, 0.1F * static_cast<float>(i % 3));
            for (std::uint32_t view = 0; view < training.targets; ++view) {
                scene::Camera camera;
                camera.width = camera.height = network.resolution;
                camera.fx = camera.fy = 131.25 / 128 * network.resolution;
                camera.cx = camera.cy = network.resolution / 2.0;
                camera.world_to_camera = {1, 0, 0, 0.05 * view, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
                cameras.push_back(camera);
            }
        }
    }
    [[nodiscard]] TrainBatch view() const {
        TrainBatch batch;
        batch.images = images;
        batch.view_to_world = poses;
        batch.quaternions = quaternions;
        batch.focals = focals;
        batch.planes = planes;
        batch.targets = targets;
        batch.cameras = cameras;
        return batch;
    }
    std::vector<float> images, targets, poses, quaternions, focals, planes;
    std::vector<scene::Camera> cameras;
};

class TrainerTest : public KernelsTest {
  protected:
    std::unique_ptr<Trainer> make(const model::ModelConfig& network, const TrainConfig& training) {
        auto made = need(Trainer::create(context(), network, training));
        EXPECT_OK(made->model().init(7));
        return made;
    }
    TrainStep run(Trainer& trainer, const Batch& batch) {
        TrainStep step;
        EXPECT_OK(trainer.step(batch.view(), step));
        return step;
    }
    static constexpr const char* kBias = "network_with_offset.out.bias";
};

}  // namespace splat::test
