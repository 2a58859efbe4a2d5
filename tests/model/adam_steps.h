#pragma once

#include <vector>

#include "model/model.h"
#include "ops/adam.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"

namespace splat::test {

/// Adam on all blocks of a model's parameters, towards outputs of zero. The gradient of half
/// the sum of their squares is the outputs themselves.
class AdamSteps {
  public:
    AdamSteps(vk::Context& context, model::Model& model) : context_(context), model_(model) {
        for (const nn::ParameterBlock& block : model.parameters().blocks()) {
            const std::vector<float> zeros(block.values.bytes / 4, 0);
            moments_.push_back(upload(context, zeros));
            moments_.push_back(upload(context, zeros));
        }
    }

    void run(std::uint64_t count, const model::ModelInput& input) {
        for (std::uint64_t step = 1; step <= count; ++step) {
            ASSERT_OK(model_.parameters().zero_gradients());
            ASSERT_OK(model_.set_input(input));
            ASSERT_OK(model_.forward());
            const auto outputs = model_.outputs().value();
            const auto gradients = model_.output_gradients().value();
            vk::Recorder copies(context_);
            ASSERT_OK(copies.copy(outputs.means, gradients.means));
            ASSERT_OK(copies.copy(outputs.opacities, gradients.opacities));
            ASSERT_OK(copies.copy(outputs.scales, gradients.scales));
            ASSERT_OK(copies.copy(outputs.rotations, gradients.rotations));
            ASSERT_OK(copies.copy(outputs.sh, gradients.sh));
            submit(copies);
            ASSERT_OK(model_.backward());
            const auto values = ops::adam_scalars({.step = step, .learning_rate = 1e-3}).value();
            const vk::Buffer scalars =
                upload(context_, std::vector<float>(values.begin(), values.end()));
            vk::Recorder update(context_);
            const auto blocks = model_.parameters().blocks();
            for (std::size_t i = 0; i < blocks.size(); ++i)
                ASSERT_OK(ops::adam(update, {scalars.range()}, blocks[i].values, blocks[i].grads,
                                    moments_[2 * i].range(), moments_[2 * i + 1].range()));
            submit(update);
            model_.parameters().changed();
        }
    }

  private:
    void submit(vk::Recorder& recorder) {
        auto list = need(recorder.finish());
        ASSERT_OK(context_.run(list));
    }

    vk::Context& context_;
    model::Model& model_;
    std::vector<vk::Buffer> moments_;
};

}  // namespace splat::test
