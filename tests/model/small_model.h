#pragma once

#include <gtest/gtest.h>

#include "model/model.h"
#include "ops/op_harness.h"
#include "support/rng_fill.h"

namespace splat::test {

using model::Model;
using model::ModelConfig;
using model::ModelOptions;

/// Small, with every kind of block: 2 levels of 16 and 8 pixels, attention at 8.
inline ModelConfig small_config() {
    ModelConfig c;
    c.resolution = 16;
    c.base_dim = 8;
    c.num_blocks = 1;
    c.channel_mult = {1, 2};
    c.attention_resolutions = {8};
    c.dropout = 0;
    return c;
}

struct Inputs {
    explicit Inputs(const ModelConfig& c, std::uint32_t objects = 1, std::uint64_t seed = 5) {
        const std::uint32_t n = objects * c.views;
        images =
            normal_fill(std::size_t{n} * c.input_channels() * c.resolution * c.resolution, seed);
        for (std::uint32_t i = 0; i < n; ++i) {
            const float pose[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
            poses.insert(poses.end(), pose, pose + 16);
            const float rotation[4] = {1, 0, 0, 0};
            quaternions.insert(quaternions.end(), rotation, rotation + 4);
        }
        tokens = normal_fill(std::size_t{n} * c.token_dim * c.tokens, seed + 1);
    }
    [[nodiscard]] model::ModelInput view() const {
        return {.images = images,
                .view_to_world = poses,
                .quaternions = quaternions,
                .focals = {},
                .embedding = {},
                .tokens = tokens};
    }
    std::vector<float> images, poses, quaternions, tokens;
};

/// Makes, fills and runs models.
class ModelTest : public KernelsTest {
  protected:
    std::unique_ptr<Model> make(const ModelConfig& config, const ModelOptions& options = {}) {
        auto made = need(Model::create(context(), config, options));
        EXPECT_OK(made->init(7));
        EXPECT_OK(made->parameters().zero_gradients());
        return made;
    }
    std::vector<float> read(const vk::BufferView& view) {
        std::vector<float> values(view.shape.elements());
        EXPECT_OK(context().read(view, values.data(), values.size() * 4));
        return values;
    }
    /// The output of the network, before the head.
    std::vector<float> run(Model& model, const Inputs& inputs) {
        EXPECT_OK(model.set_input(inputs.view()));
        EXPECT_OK(model.forward());
        return read(model.raw_output());
    }
    /// Random gradients of all outputs, for a backward pass.
    void write_gradients(Model& model, std::uint64_t seed) {
        const auto g = model.output_gradients().value();
        for (const auto& view : {g.means, g.opacities, g.scales, g.rotations, g.sh}) {
            const std::vector<float> values = normal_fill(view.shape.elements(), seed);
            EXPECT_OK(context().write(view, values.data(), values.size() * 4));
        }
    }
    void randomise(Model& model, std::uint64_t seed) {
        for (const nn::Parameter& parameter : model.parameters().all())
            EXPECT_OK(model.parameters().write(
                parameter, normal_fill(parameter.shape.elements(), seed++, 0, 0.1)));
    }
};

inline double relative_l2(const std::vector<float>& a, const std::vector<float>& b) {
    EXPECT_EQ(a.size(), b.size());
    double difference = 0, norm = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        difference += std::pow(static_cast<double>(a[i]) - static_cast<double>(b[i]), 2);
        norm += std::pow(static_cast<double>(b[i]), 2);
    }
    return std::sqrt(difference / norm);
}

}  // namespace splat::test
