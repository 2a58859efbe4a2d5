#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "nn/executor.h"

namespace splat::nn {

/// One operator on row-major tensors that the caller owns: a graph of one node, bound to them. For tests,
/// benchmarks and the C API.
class OpInstance {
  public:
    struct Tensors {
        std::vector<vk::BufferView>
            inputs;  ///< row-major; without a buffer where an optional one is absent
        std::vector<vk::BufferView> outputs;
        std::vector<vk::BufferView> grad_outputs;  ///< empty: no backward pass
        std::vector<vk::BufferView> grad_inputs;   ///< without a buffer where not computed
        bool accumulate = false;  ///< gradients of row-major inputs are added to what is there
    };

    /// Errors: kShape (which tensor, its shape, the one expected), and those of the operator and
    /// the device's memory.
    static Result<std::unique_ptr<OpInstance>> create(vk::Context& context, const ops::OpRow& row,
                                                      std::span<const JsonScalar> attributes,
                                                      const Tensors& tensors);

    Status forward();

    /// At the inputs of the last forward. kInvalidState before the first or without grad_outputs.
    Status backward();

    /// Saved tensor i of the row, row-major.
    [[nodiscard]] const vk::BufferView& saved(std::size_t i) const { return executor_->saved()[i]; }

  private:
    OpInstance(vk::Context& context, const ops::OpRow& row) : row_(row), graph_(context) {}
    Status check_shapes(const Tensors& tensors) const;

    const ops::OpRow& row_;
    Graph graph_;
    std::optional<Parameters> parameters_;  ///< none: what a row calls parameters are inputs here
    std::unique_ptr<Executor> executor_;
    bool has_backward_ = false;
    bool wants_gradients_ = false;
    bool ran_ = false;
};

}  // namespace splat::nn
