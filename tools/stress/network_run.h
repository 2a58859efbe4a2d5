#pragma once

#include <string>
#include <vector>

#include "stress/network.h"
#include "vkrun/cli/handles.h"

namespace vkrun::stress {

/// A network on a device: an operator of the library for each node.
class NetworkOnDevice {
  public:
    NetworkOnDevice(splat_device device, const Network& net);

    void forward();
    void backward();
    [[nodiscard]] std::vector<float> value(std::size_t tensor) const {
        return read_tensor(values_[tensor].get());
    }
    [[nodiscard]] std::vector<float> gradient(std::size_t tensor) const {
        return read_tensor(gradients_[tensor].get());
    }
    /// Gradient of a tensor without readers; 1 at first.
    void set_gradient(std::size_t tensor, const std::vector<float>& values);
    void set_value(std::size_t tensor, const std::vector<float>& values);
    [[nodiscard]] splat_tensor value_tensor(std::size_t tensor) const {
        return values_[tensor].get();
    }
    [[nodiscard]] splat_tensor gradient_tensor(std::size_t tensor) const {
        return gradients_[tensor].get();
    }

  private:
    std::vector<Tensor> values_, gradients_;
    std::vector<Tensor> parts_;  ///< gradients by single readers
    std::vector<Op> nodes_;
    std::vector<std::vector<Op>> sums_;  ///< sums over a node's outputs, before its backward pass
};

}  // namespace vkrun::stress
