#include "ops/losses/l2.h"

#include <gtest/gtest.h>

#include "ops/every/op_samples.h"
#include "ref/losses/l2_ref.h"
#include "support/golden.h"

namespace splat::test {
namespace {

class L2 : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(L2);

OpCall l2_call(const HostTensor& a, const HostTensor& b, float grad_loss) {
    return sample("l2", Json::object(), {a, b}, std::vector<HostTensor>{{{1}, {grad_loss}}});
}

/// One element, ends of chunks, channels that pad a quad, a batch.
TEST_P(L2, MatchesFloat64) {
    std::uint64_t seed = 10;
    for (const Shape& shape : {Shape{1, 1}, Shape{2, 5, 7}, Shape{1, 3, 32, 32},
                               Shape{1, 4, 25, 41}, Shape{4, 7, 17, 31}, Shape{4, 3, 128, 128}}) {
        seed += 2;
        const OpCall call =
            l2_call(normal_tensor(shape, seed), normal_tensor(shape, seed + 1, 0.3), 1.5F);
        const std::vector<double> a = to_double(call.inputs[0].values);
        const std::vector<double> b = to_double(call.inputs[1].values);
        expect_matches(context(), call, {ref::l2_forward(a, b)}, {ref::l2_backward(a, b, 1.5), {}},
                       shape.text());
    }
}

TEST_P(L2, EqualImagesGiveZero) {
    const HostTensor a = normal_tensor({2, 3, 4, 5}, 40);
    const OpResult gpu = run_op(context(), l2_call(a, a, 2));
    ASSERT_OK(gpu.status);
    EXPECT_EQ(gpu.outputs[0][0], 0);
    for (const float gradient : gpu.grad_inputs[0]) EXPECT_EQ(gradient, 0);
}

TEST_P(L2, GoldenNet) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    for (const std::string& path : golden_files("net", "metric")) {
        const auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        for (const std::string pair : {"0", "1", "2"}) {
            const auto name = [&pair](const char* key) { return pair + "." + key; };
            const OpResult gpu =
                run_op(context(), l2_call(image_batch(golden_tensor(npz.value(), name("a"))),
                                          image_batch(golden_tensor(npz.value(), name("b"))), 1));
            ASSERT_OK(gpu.status);
            EXPECT_TRUE(close(gpu.outputs[0], golden_values(npz.value(), name("l264")), 0,
                              kGoldenLayer, {"loss", reproduce(name(path.c_str()))}));
            EXPECT_TRUE(close(gpu.grad_inputs[0], golden_values(npz.value(), name("d_l264")), 1e-10,
                              kGoldenLayer, {"grad_a", reproduce(name(path.c_str())), true}));
        }
    }
}

TEST_P(L2, RejectsBadShapes) {
    const auto status = [this](const Shape& a, const Shape& b) {
        return run_op(context(), l2_call(normal_tensor(a, 1), normal_tensor(b, 2), 1)).status;
    };
    EXPECT_ERROR(status({2, 3, 4}, {2, 4, 3}), Code::kShape, "'b'");
    EXPECT_ERROR(status({6}, {6}), Code::kShape, "channels");
}

TEST(L2Reference, GradcheckFloat64) {
    const std::vector<double> a = to_double(normal_fill(40, 1));
    const std::vector<double> b = to_double(normal_fill(40, 2));
    expect_gradcheck({a, b},
                     [](const Arrays& in) { return Arrays{ref::l2_forward(in[0], in[1]).value}; },
                     {{1.5}}, {ref::l2_backward(a, b, 1.5).value, {}});
}

}  // namespace
}  // namespace splat::test
