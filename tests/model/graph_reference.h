#pragma once

#include <map>
#include <memory>
#include <vector>

#include "nn/executor.h"

namespace splat::test {

/// Runs a graph in float64 by the references of tests/ref, node by node: no plan, no kernels.
class GraphReference {
  public:
    explicit GraphReference(const nn::Graph& graph) : graph_(graph) {}

    /// An input or a parameter, row-major.
    void put(nn::ValueId id, const std::vector<double>& values) { values_[id] = values; }
    void forward();

    /// The gradients of the sum of `grad` * the value.
    void backward(nn::ValueId id, const std::vector<double>& grad);

    const std::vector<double>& value(nn::ValueId id);
    /// Zeros where the output does not depend on the value.
    const std::vector<double>& gradient(nn::ValueId id);

  private:
    void add_gradient(nn::ValueId id, const std::vector<double>& grad);

    const nn::Graph& graph_;
    std::map<nn::ValueId, std::vector<double>> values_;
    std::map<nn::ValueId, std::vector<double>> gradients_;
};

/// Euclidean.
double norm_of(const std::vector<double>& values);

/// Runs the same graph on a device, forward and backward. The caller gives both the same inputs and
/// parameters.
class GraphRun {
  public:
    /// Errors: those of Parameters and Executor.
    static Result<std::unique_ptr<GraphRun>> create(vk::Context& context, const nn::Graph& graph,
                                                    nn::ValueId output,
                                                    const std::vector<nn::ValueId>& grad_inputs);
    Status put(nn::ValueId id, const std::vector<float>& values);
    /// With the gradient of the output.
    Status run(const std::vector<float>& grad_output);

    [[nodiscard]] std::vector<float> output() const { return output_values_; }
    /// Gradient of a parameter or of one of grad_inputs.
    [[nodiscard]] std::vector<float> gradient(nn::ValueId id) const;

  private:
    GraphRun(vk::Context& context, const nn::Graph& graph, nn::ValueId output)
        : context_(context), graph_(graph), output_(output) {}
    Status read(const vk::BufferView& view, std::vector<float>& values) const;

    vk::Context& context_;
    const nn::Graph& graph_;
    nn::ValueId output_;
    std::unique_ptr<nn::Parameters> parameters_;
    std::unique_ptr<nn::Executor> executor_;
    std::vector<float> output_values_;
};

}  // namespace splat::test
