#pragma once

#include <map>
#include <memory>
#include <span>
#include <vector>

#include "nn/executor.h"

namespace splat::model {

/// Runs a batch in parts, through an executor that takes one part of its objects at a time. Inputs, results
/// and gradients are kept for all objects, activations only for one part, so the backward pass repeats the forward pass
/// of every part except the last.
class ObjectSlices {
  public:
    /// The first dimension of each is that of the objects.
    struct Ports {
        std::span<const nn::ValueId> inputs;  ///< inputs that differ between the parts
        std::span<const nn::ValueId> outputs;
        std::span<const nn::ValueId> graded_outputs;
        std::span<const nn::ValueId> graded_inputs;
    };

    /// `count` parts of the same size. Errors: kOutOfDeviceMemory, kUnsupported if
    /// the device or an index cannot take the results of all objects.
    static Result<std::unique_ptr<ObjectSlices>> create(vk::Context& context,
                                                        nn::Executor& executor, const Ports& ports,
                                                        std::uint32_t count);

    /// Runs the executor on each slice, with its errors.
    Status forward();
    /// `between`: between the parts of the last slice's pass.
    Status backward(const nn::BetweenParts& between = {});

    /// An input or output of all objects.
    [[nodiscard]] const vk::BufferView& tensor(nn::ValueId id) const {
        const auto input = inputs_.find(id);
        return input != inputs_.end() ? input->second.view : outputs_.at(id).view;
    }
    [[nodiscard]] const vk::BufferView& gradient(nn::ValueId id) const {
        const auto input = input_gradients_.find(id);
        return input != input_gradients_.end() ? input->second.view : gradients_.at(id).view;
    }

  private:
    struct Joined {
        vk::Buffer buffer;
        vk::BufferView view;
    };
    ObjectSlices(vk::Context& context, nn::Executor& executor, std::uint32_t count)
        : context_(context), executor_(executor), count_(count) {}
    /// Memory for tensors like `part`, along their first dimension.
    [[nodiscard]] Result<Joined> join(const vk::BufferView& part) const;
    Status record(std::uint32_t part);
    Status run(std::uint32_t part);

    vk::Context& context_;
    nn::Executor& executor_;
    std::uint32_t count_;
    std::map<nn::ValueId, Joined> inputs_, outputs_, gradients_, input_gradients_;
    /// Copies of a part: of inputs in, of outputs out, and of their gradients.
    struct Copies {
        vk::CommandList inputs, outputs, gradients, input_gradients;
    };
    std::vector<Copies> copies_;  ///< by part
    bool ran_ = false;            ///< forward, and not yet backward
};

}  // namespace splat::model
