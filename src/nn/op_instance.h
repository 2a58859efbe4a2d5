#pragma once

#include <memory>
#include <vector>

#include "ops/op_table.h"
#include "vk/context.h"

namespace splat::nn {

/// One operator recorded on row-major tensors: conversion to quads, the operator, conversion back.
/// For tests, benchmarks and the C API; the graph executor keeps activations in quads throughout.
class OpInstance {
  public:
    struct Tensors {
        std::vector<vk::BufferView>
            inputs;  ///< row-major; without a buffer where an optional one is absent
        std::vector<vk::BufferView> outputs;
        std::vector<vk::BufferView> grad_outputs;  ///< empty: no backward pass
        std::vector<vk::BufferView> grad_inputs;   ///< without a buffer where not wanted
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
    [[nodiscard]] const vk::BufferView& saved(std::size_t i) const { return views_.saved[i]; }

  private:
    OpInstance(vk::Context& context, const ops::OpRow& row) : context_(context), row_(row) {}
    Status check_shapes(const ops::OpPlan& plan, const Tensors& tensors) const;
    Status allocate(const ops::OpPlan& plan, const Tensors& tensors);
    Status record(const ops::Attributes& attributes, const Tensors& tensors);
    Result<vk::BufferView> scratch(const Shape& shape, ops::Layout layout);
    Result<vk::BufferView> on_device(const vk::BufferView& tensor, ops::Layout layout);

    vk::Context& context_;
    const ops::OpRow& row_;
    ops::OpViews views_;
    std::vector<vk::Buffer> buffers_;
    vk::CommandList forward_;
    vk::CommandList backward_;
    bool has_backward_ = false;
    bool ran_ = false;
};

}  // namespace splat::nn
