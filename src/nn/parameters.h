#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "nn/graph.h"
#include "vk/context.h"
#include "vk/outside_use.h"

namespace splat::nn {

struct Parameter {
    std::string name;
    Shape shape;
    bool trainable = false;
    vk::BufferView value;
    vk::BufferView grad;  ///< without a buffer if frozen or created without gradients
};

/// A range of device memory with the values of several trainable parameters, and one of the same layout
/// for their gradients: the unit that an optimiser updates in one dispatch. Padding between parameters
/// is zero.
struct ParameterBlock {
    vk::BufferView values;
    vk::BufferView grads;
};

/// The parameters of a graph on the device. Those with gradients lie in blocks, with equal blocks of gradients.
class Parameters {
  public:
    /// All zero. Without `gradients` no parameter has one. Errors: kOutOfDeviceMemory.
    static Result<Parameters> create(vk::Context& context, const Graph& graph,
                                     bool gradients = true);

    [[nodiscard]] const std::vector<Parameter>& all() const { return parameters_; }
    [[nodiscard]] std::span<const ParameterBlock> blocks() const { return blocks_; }

    /// The parameter of a graph's value.
    [[nodiscard]] const Parameter& of(ValueId value) const { return parameters_[index_[value]]; }

    /// nullptr for an unknown name.
    [[nodiscard]] const Parameter* find(std::string_view name) const;

    /// Row-major elements, as many as the shape has. Errors: those of Context::write and read.
    Status write(const Parameter& parameter, std::span<const float> values);
    template <class Floats>
    Status read(const vk::BufferView& view, Floats& values) {
        values.resize(view.shape.elements());
        return context_->read(view, values.data(), values.size() * sizeof(float));
    }

    Status zero_gradients();

    /// Grows whenever values change; forms prepared from older values are stale.
    [[nodiscard]] std::uint64_t revision() const { return revision_ + outside_->writes; }
    void changed() { ++revision_; }

    /// Outside use of the values, by tensors that share their memory.
    [[nodiscard]] const std::shared_ptr<vk::OutsideUse>& outside() const { return outside_; }

    [[nodiscard]] std::uint64_t elements() const;

  private:
    explicit Parameters(vk::Context& context) : context_(&context) {}

    vk::Context* context_;
    std::vector<Parameter> parameters_;
    std::vector<std::size_t> index_;  ///< by ValueId
    std::vector<vk::Buffer> buffers_;
    std::vector<ParameterBlock> blocks_;
    std::uint64_t revision_ = 1;
    std::shared_ptr<vk::OutsideUse> outside_ = std::make_shared<vk::OutsideUse>();
};

}  // namespace splat::nn
