#pragma once

#include <cstddef>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "nn/executor.h"

namespace splat::model {

/// Runs a batch in parts, through an executor that takes one part of its objects at a time. Inputs and
/// results are kept for all objects, activations only for one part, so the backward pass repeats the forward pass
/// of every part except the last.
class ObjectSlices {
  public:
    /// The first dimension of each is that of the objects.
    struct Ports {
        std::span<const nn::ValueId> outputs;
        std::span<const nn::ValueId> graded_outputs;
        std::span<const nn::ValueId> graded_inputs;
    };

    /// `count` parts of the same size. Errors: kOutOfDeviceMemory, kUnsupported if
    /// the device or an index cannot take the results of all objects.
    static Result<std::unique_ptr<ObjectSlices>> create(vk::Context& context,
                                                        nn::Executor& executor, const Ports& ports,
                                                        std::uint32_t count);

    /// Set an input of all objects: for each part the bytes of the executor's input.
    void hold(nn::ValueId input, std::span<const std::byte> bytes);

    /// As the executor's, with its errors.
    Status forward();
    Status backward();

    /// Of all objects.
    [[nodiscard]] const vk::BufferView& tensor(nn::ValueId output) const {
        return tensors_.at(output).view;
    }
    [[nodiscard]] const vk::BufferView& gradient(nn::ValueId output) const {
        return gradients_.at(output).view;
    }
    [[nodiscard]] const std::vector<float>& input_gradient(nn::ValueId input) const {
        return input_gradients_.at(input);
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
    Status run(std::uint32_t part);

    vk::Context& context_;
    nn::Executor& executor_;
    std::uint32_t count_;
    std::map<nn::ValueId, std::vector<std::byte>> inputs_;
    std::map<nn::ValueId, Joined> tensors_, gradients_;
    std::map<nn::ValueId, std::vector<float>> input_gradients_;
    std::vector<vk::CommandList> gather_, scatter_;  ///< by part: of outputs, of their gradients
    bool ran_ = false;                               ///< forward, and not yet backward
};

}  // namespace splat::model
