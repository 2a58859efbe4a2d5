#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "ref/op_ref.h"
#include "ref/summed.h"
#include "stress/stress.h"
#include "vkrun/cli/json.h"

namespace vkrun::stress {

using Numbers = std::vector<double>;

enum class Role {
    kConstant,    ///< given, without gradient
    kInput,       ///< given
    kParameter,   ///< given, and trained
    kActivation,  ///< a result
};

struct NetTensor {
    std::string name;
    std::vector<std::size_t> dims;  ///< empty: an optional input that is absent
    Role role = Role::kActivation;
    std::vector<float> values;  ///< none for an activation
};

struct NetNode {
    std::string op;
    Json attributes;
    std::vector<std::size_t> inputs;  ///< tensors
    std::vector<std::size_t> outputs;
};

/// Operators in the order in which they run. An activation that several nodes read gets the sum of their gradients.
struct Network {
    std::vector<NetTensor> tensors;
    std::vector<NetNode> nodes;

    std::size_t give(const std::string& name, const std::vector<std::size_t>& dims, Role role,
                     double mean, double deviation);
    std::size_t add(const std::string& op, const Json& attributes,
                    const std::vector<std::size_t>& inputs, const std::vector<std::size_t>& dims);
    std::vector<std::size_t> add_several(const std::string& op, const Json& attributes,
                                         const std::vector<std::size_t>& inputs,
                                         const std::vector<std::vector<std::size_t>>& dims);
    [[nodiscard]] std::vector<std::size_t> parameters() const;
    [[nodiscard]] bool has_gradient(std::size_t tensor) const {
        return tensors[tensor].role != Role::kConstant;
    }
};

/// A convolution with Glorot's weights and a bias.
std::size_t add_conv(Network& net, std::size_t x, std::size_t out, std::size_t kernel,
                     int winograd = 0);
/// Group normalisation and SiLU.
std::size_t add_norm(Network& net, std::size_t x, std::size_t groups);

/// A residual network x -> y [1,4,side,side] of `depth` blocks (normalisation, SiLU, convolution, sum), one of them
/// with attention if there are four, and the mean square of y minus a target. Tensors "x", "y", "loss".
struct ResidualShape {
    std::size_t depth = 2;
    std::size_t width = 8;
    std::size_t side = 6;
    int winograd = 0;
    double scale = 1;  ///< deviation of x and of the target
};
Network residual_network(const ResidualShape& shape);
std::size_t tensor_named(const Network& net, const std::string& name);

/// Moves every number of every result by up to what its operator may be off, at random.
class NetNoise {
  public:
    explicit NetNoise(unsigned seed) : random_(seed) {}
    [[nodiscard]] double unit() { return unit_(random_); }
    Numbers moved(const splat::ref::Summed<double>& sums, double factor);

  private:
    std::mt19937 random_;
    std::uniform_real_distribution<double> unit_{-1, 1};
};

/// A network in float64.
class NetworkInDouble {
  public:
    explicit NetworkInDouble(const Network& net);

    /// noise  nullptr: exact
    void forward(NetNoise* noise);
    /// From `gradients` of the tensors without readers, which are set before. Overwrites all others.
    void backward(NetNoise* noise);

    std::vector<Numbers> values;     ///< by tensor
    std::vector<Numbers> gradients;  ///< by tensor

  private:
    [[nodiscard]] splat::ref::OpArguments arguments_of(const NetNode& node) const;

    const Network& net_;
    std::vector<bool> is_read_;
};

}  // namespace vkrun::stress
