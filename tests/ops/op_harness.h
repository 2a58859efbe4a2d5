#pragma once

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "nn/op_instance.h"
#include "ref/op_ref.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/npz.h"
#include "support/rng_fill.h"

namespace splat::test {

struct HostTensor {
    Shape shape;
    std::vector<float> values;  ///< row-major; empty: the tensor is absent
};

/// One call of an operator of ops/op_table.cpp on row-major tensors.
struct OpCall {
    std::string op;
    Json attributes = Json::object();
    std::vector<HostTensor> inputs;
    std::vector<HostTensor> grad_outputs;  ///< empty: forward only
    std::vector<std::vector<float>>
        accumulate_to;  ///< gradients to add to, one per input; empty: overwrite
    std::vector<std::string> unwanted = {};  ///< inputs whose gradients are not requested
    int runs = 1;                            ///< forward and backward are run so often
};

OpCall sample(const std::string& op, const Json& attributes, const std::vector<HostTensor>& inputs,
              const std::vector<HostTensor>& grad_outputs);

/// With gradients of every output, for outputs of the given shapes.
OpCall sample(const std::string& op, const Json& attributes, const std::vector<HostTensor>& inputs,
              const std::vector<Shape>& outputs);

/// The examples of every operator's reference, for the properties of all operators: the same bits on every run and
/// with any number of threads, each gradient alone, sums into the gradients of parameters, every kernel in use.
std::vector<OpCall> op_samples();

/// The tensors after the last run. Absent tensors are empty.
struct OpResult {
    Status status;
    std::vector<std::vector<float>> outputs;
    std::vector<std::vector<float>> saved;
    std::vector<std::vector<float>> grad_inputs;
};

/// Runs a call. Fails the test if the padding after the last element of an output changed, or a
/// guard byte.
OpResult run_op(vk::Context& context, const OpCall& call);

/// Each gradient of `call`, requested alone, equals that of the whole call bit by bit.
void expect_each_gradient_alone(vk::Context& context, const OpCall& call);

/// Runs the call and compares its outputs and gradients, in the order of the row's ports, with their
/// references, by the tolerances of (op, port) and (op, grad_port). References without elements are
/// skipped. Without gradients, only the forward pass runs.
void expect_matches(vk::Context& context, const OpCall& call,
                    const std::vector<ref::Summed<double>>& outputs,
                    const std::vector<ref::Summed<double>>& gradients, const std::string& what);

/// The call as its reference takes it.
ref::OpArguments arguments_of(const OpCall& call);

/// Results of the operator's reference for a call.
struct OpExpected {
    ref::Sums outputs;
    ref::Sums grad_inputs;  ///< nothing where the call has no gradients
};
OpExpected expected_of(const OpCall& call);

/// expect_matches() with those.
void expect_float64(vk::Context& context, const OpCall& call, const std::string& what);

/// The call with whole numbers, whose sums are exact, in the place of all values.
OpCall with_integers(OpCall call, std::uint64_t seed);

/// Outputs and gradients are those of the reference, as numbers; `few`: of so few numbers that many are zero.
void expect_exact(vk::Context& context, const OpCall& call, const std::string& what, bool few);

/// The output is linear in each of these inputs alone: its product with its gradient is that of the input with its
/// own, up to 1e-5 of the sum of magnitudes.
void expect_adjoint(vk::Context& context, const OpCall& call,
                    std::initializer_list<std::size_t> inputs, const std::string& what);

using Arrays = std::vector<std::vector<double>>;

/// Each of `gradients` that is not empty is the central difference of the sum of grad_outputs *
/// forward(inputs).
void expect_gradcheck(const Arrays& inputs, const std::function<Arrays(const Arrays&)>& forward,
                      const Arrays& grad_outputs, const Arrays& gradients);

/// The same of the reference of the call's operator.
void expect_gradcheck(const OpCall& call);

/// For operators without groups or parameters: the images of kNormShapes (odd sizes, batches of one
/// to three, some beyond the size of a vector, quad or workgroup), matrices, and a line.
std::vector<Shape> image_shapes();

/// A tensor of normal numbers.
HostTensor normal_tensor(const Shape& shape, std::uint64_t seed, double mean = 0, double std = 1);

/// Member `name` of a golden file; records a failure if it is not there.
HostTensor golden_tensor(const Npz& npz, const std::string& name);

/// An image [C, H, W] as a batch of one.
inline HostTensor image_batch(HostTensor image) {
    image.shape = {1, image.shape[0], image.shape[1], image.shape[2]};
    return image;
}

/// Test suites run once per set of kernels: TEST_P(GroupNorm, ...) with context() of those kernels.
class KernelsTest : public testing::TestWithParam<vk::Kernels> {
  protected:
    void SetUp() override;
    [[nodiscard]] vk::Context& context() const { return *context_; }

  private:
    vk::Context* context_ = nullptr;
};

inline std::string kernels_test_name(const testing::TestParamInfo<vk::Kernels>& info) {
    return vk::kernels_name(info.param);
}

}  // namespace splat::test

#define SPLAT_INSTANTIATE_KERNELS(suite)                                          \
    INSTANTIATE_TEST_SUITE_P(                                                     \
        Kernels, suite,                                                           \
        testing::Values(::splat::vk::Kernels::kPlain, ::splat::vk::Kernels::kCpu, \
                        ::splat::vk::Kernels::kGpu),                              \
        ::splat::test::kernels_test_name)
