#pragma once

#include <splat.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "ref/op_ref.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace vkrun {

/// A tensor of an operator with its values; for an output, these are its gradient.
struct CaseTensor {
    std::string name;
    std::vector<std::int64_t> dims;  ///< empty: an optional input that is absent
    std::vector<float> values;
    bool constant = false;  ///< an input without gradient
};

/// One operator on one set of shapes and values.
struct OpCase {
    std::string op;     ///< a name of splat_op_list
    std::string title;  ///< shapes and attributes, short
    Json attributes;
    std::vector<CaseTensor> inputs;
    std::vector<CaseTensor> outputs;
    bool plain =
        true;  ///< time the plain kernels, too; false if another case of the same shapes does
};

/// Normal numbers, the same on every machine.
CaseTensor filled(const char* name, const std::vector<std::size_t>& dims, std::uint64_t seed,
                  double mean, double deviation);

/// A call of a reference's row, with values, and gradients of outputs.
OpCase example_case(const std::string& op_name, const splat::ref::OpExample& example);

/// The float64 result of some elements of a tensor.
struct Samples {
    splat::ref::Summed<double> sums;
    std::vector<std::size_t> elements;  ///< empty: all of them

    Samples() = default;
    Samples(splat::ref::Summed<double> all) : sums(std::move(all)) {}
};

/// An operator's attributes with the defaults of the library's list, booleans as 0 and 1.
std::map<std::string, double> attributes_of(const std::string& op_name, const Json& given);

/// The float64 results of a case.
struct CaseReference {
    std::vector<Samples> outputs;
    std::vector<Samples> grad_inputs;  ///< in the order of the inputs; empty for constant ones
};
CaseReference reference_of(const OpCase& op_case);

/// A case on a device: its tensors, filled, and its operator.
class CaseOnDevice {
  public:
    CaseOnDevice(splat_device device, const OpCase& op_case);
    void forward();
    void backward();
    [[nodiscard]] std::vector<float> output(std::size_t i) const {
        return read_tensor(outputs_[i].get());
    }
    [[nodiscard]] std::vector<float> grad_input(std::size_t i) const {
        return read_tensor(grad_inputs_[i].get());
    }

  private:
    std::vector<Tensor> inputs_;
    std::vector<Tensor> grad_inputs_;
    std::vector<Tensor> outputs_;
    std::vector<Tensor> grad_outputs_;
    Op op_;
};

/// How far a float32 result lies from float64.
struct TensorError {
    std::string tensor;
    double relative_l2 = 0;  ///< ||gpu - ref|| / ||ref||
    double max_abs = 0;      ///< largest |gpu - ref|
    /// Largest |gpu - ref| in units of 2^-24 * (1 + sqrt(K)) * S, the rounding of a sum of K terms
    /// whose magnitudes add up to S. The library promises at most kErrorLimit.
    double max_roundings = 0;
};
constexpr double kErrorLimit = 4;

TensorError compare(const std::string& name, const std::vector<float>& gpu, const Samples& samples);

std::vector<TensorError> forward_errors(const OpCase& op_case, const CaseOnDevice& run,
                                        const CaseReference& reference);
std::vector<TensorError> backward_errors(const OpCase& op_case, const CaseOnDevice& run,
                                         const CaseReference& reference);

/// The largest of each figure, over all tensors; NaN if any is NaN.
TensorError worst(const std::vector<TensorError>& errors);

/// Every figure is finite and within the library's promise.
bool good(const std::vector<TensorError>& errors);

}  // namespace vkrun
