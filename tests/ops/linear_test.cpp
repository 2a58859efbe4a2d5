#include "ops/linear.h"

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/shapes.h"

namespace splat::test {
namespace {

OpCall linear_call(const MatrixShape& s, bool bias, std::uint64_t seed) {
    return sample("linear", Json::object(),
                  {normal_tensor({s.rows, s.in}, seed), normal_tensor({s.out, s.in}, seed + 1),
                   bias ? normal_tensor({s.out}, seed + 2) : HostTensor{}},
                  std::vector<HostTensor>{normal_tensor({s.rows, s.out}, seed + 3)});
}

class Linear : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Linear);

void expect_normal(vk::Context& context, const MatrixShape& shape, bool bias, std::uint64_t seed) {
    expect_float64(context, linear_call(shape, bias, seed),
                   shape.text() + (bias ? "" : " no bias"));
}

TEST_P(Linear, ForwardMatchesFloat64) {
    std::uint64_t seed = 100;
    for (const MatrixShape& shape : kMatrixShapes) {
        ++seed;
        OpCall call = linear_call(shape, seed % 3 != 0, seed);
        call.grad_outputs.clear();
        expect_float64(context(), call, shape.text() + (seed % 3 != 0 ? "" : " no bias"));
    }
}

TEST_P(Linear, BackwardMatchesFloat64) {
    std::uint64_t seed = 200;
    for (const MatrixShape& shape : kMatrixBackwardShapes) {
        expect_normal(context(), shape, true, ++seed);
        if (HasFailure()) return;
    }
    expect_normal(context(), {17, 15, 31}, false, 250);
}

TEST_P(Linear, IntegersAreExact) {
    std::uint64_t seed = 300;
    for (const MatrixShape& shape :
         kMatrixShapes)  // sums stay below 2^24; a ninth of the integers is 0
        expect_exact(context(), with_integers(linear_call(shape, true, 1), ++seed), shape.text(),
                     shape.rows * shape.out < 10);
}

TEST_P(Linear, AdjointIdentity) {
    std::uint64_t seed = 400;
    for (const MatrixShape& shape : kMatrixBackwardShapes)
        expect_adjoint(context(), linear_call(shape, false, ++seed), {0, 1}, shape.text());
}

TEST_P(Linear, LongSumsStayAccurate) {
    expect_normal(context(), {3, 9216, 5}, true, 500);
    // grad_weight over 8 images of 128 x 128: a plain sequential loop costs two digits, and
    // lavapipe silently leaves any loop after 65535 turns, nested ones counted together.
    expect_normal(context(), {131072, 3, 5}, true, 510);
    expect_normal(context(), {1048576, 2, 3}, true, 520);
}

TEST_P(Linear, CancellationStaysWithinTheBound) {
    OpCall call = linear_call({9, 1024, 33}, true, 530);
    std::vector<float>& x = call.inputs[0].values;
    std::vector<float>& weight = call.inputs[1].values;
    for (std::size_t i = 0; i < x.size(); ++i) x[i] += i % 2 == 0 ? 1e4F : -1e4F;
    for (std::size_t i = 1; i < weight.size(); i += 2) weight[i] = weight[i - 1];
    expect_float64(context(), call, "9 1024 33");
}

TEST_P(Linear, RejectsBadShapes) {
    const auto status = [&](const auto& change) {
        OpCall call = linear_call({3, 5, 7}, true, 620);
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[1].shape = {5, 7}; }), Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[1].shape = {35}; }), Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[0].shape = {3, 5, 1}; }), Code::kShape, "'x'");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[2] = {{6}, std::vector<float>(6)};
                 }),
                 Code::kShape, "bias");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["bias"] = true; }), Code::kInvalidArgument,
                 "bias");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.grad_outputs[0].shape = {7, 3};
                 }),
                 Code::kShape, "grad_y");
}

TEST(LinearReference, GradcheckFloat64) {
    std::uint64_t seed = 700;
    for (const MatrixShape& shape :
         {MatrixShape{1, 1, 1}, MatrixShape{3, 5, 7}, MatrixShape{8, 4, 2}})
        expect_gradcheck(linear_call(shape, true, ++seed));
}

TEST(LinearCheck, RefusesProductsBeyond31Bits) {
    vk::DeviceInfo cpu, gpu;
    cpu.kind = vk::DeviceKind::kCpu;
    gpu.kind = vk::DeviceKind::kDiscrete;
    for (const vk::DeviceInfo& device : {cpu, gpu}) {
        EXPECT_OK(ops::linear_check(device, {1U << 15, 1U << 15, 16, true}));
        for (const ops::LinearDesc& desc : {ops::LinearDesc{1U << 16, 1U << 16, 1, true},
                                            {1U << 16, 1, 1U << 16, true},
                                            {1, 1U << 16, 1U << 16, true},
                                            {~0U, ~0U, ~0U, true}})
            EXPECT_ERROR(ops::linear_check(device, desc), Code::kUnsupported, "2^31");
    }
    EXPECT_ERROR(ops::linear_check(cpu, {1, 65001, 1, true}), Code::kUnsupported, "at most 65000");
    EXPECT_OK(ops::linear_check(gpu, {1, 65001, 1, true}));
}

}  // namespace
}  // namespace splat::test
