#pragma once

#include <vector>

#include "model/predictor.h"
#include "ops/adam.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"

namespace splat::test {

/// Adam on all blocks of a predictor's parameters, towards outputs of zero. The gradient of half
/// the sum of their squares is the outputs themselves.
class AdamSteps {
  public:
    AdamSteps(vk::Context& context, model::Predictor& predictor)
        : context_(context), predictor_(predictor) {
        for (const nn::ParameterBlock& block : predictor.parameters().blocks()) {
            const std::vector<float> zeros(block.values.bytes / 4, 0);
            moments_.push_back(upload(context, zeros));
            moments_.push_back(upload(context, zeros));
        }
    }

    void run(std::uint64_t count, const model::PredictorInput& input) {
        for (std::uint64_t step = 1; step <= count; ++step) {
            ASSERT_OK(predictor_.parameters().zero_gradients());
            ASSERT_OK(predictor_.set_input(input));
            ASSERT_OK(predictor_.forward());
            const auto outputs = predictor_.outputs();
            const auto gradients = predictor_.output_gradients();
            vk::Recorder copies(context_);
            ASSERT_OK(copies.copy(outputs.means, gradients.means));
            ASSERT_OK(copies.copy(outputs.opacities, gradients.opacities));
            ASSERT_OK(copies.copy(outputs.scales, gradients.scales));
            ASSERT_OK(copies.copy(outputs.rotations, gradients.rotations));
            ASSERT_OK(copies.copy(outputs.sh, gradients.sh));
            submit(copies);
            ASSERT_OK(predictor_.backward());
            vk::Recorder update(context_);
            const auto blocks = predictor_.parameters().blocks();
            for (std::size_t i = 0; i < blocks.size(); ++i)
                ASSERT_OK(ops::adam(update, {.step = step, .learning_rate = 1e-3}, blocks[i].values,
                                    blocks[i].grads, moments_[2 * i].range(),
                                    moments_[2 * i + 1].range()));
            submit(update);
            predictor_.parameters().changed();
        }
    }

  private:
    void submit(vk::Recorder& recorder) {
        auto list = recorder.finish();
        ASSERT_OK(list.status());
        ASSERT_OK(context_.run(list.value()));
    }

    vk::Context& context_;
    model::Predictor& predictor_;
    std::vector<vk::Buffer> moments_;
};

}  // namespace splat::test
