// Layers of golden/net/norm*.npz, computed once with PyTorch; see tests/golden/net/INDEX.md for
// the keys.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

class GoldenNetNorm : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetNorm);

/// Names `<prefix>...` of the cases that have a tensor x.
std::vector<std::string> cases(const Golden& golden, const std::string& prefix,
                               const std::set<std::string>& of_shipped) {
    std::vector<std::string> found;
    for (const std::string& name : golden.cases("x"))
        if (name.starts_with(prefix)) found.push_back(name);
    golden.expect_cases(found, of_shipped);
    return found;
}

HostTensor tensor(const Golden& golden, const std::string& name) {
    return golden_tensor(golden.npz, name);
}

void expect_close(const Golden& golden, const std::string& name, const std::vector<float>& gpu,
                  bool gradient) {
    EXPECT_TRUE(close(gpu, golden.doubles(name), kGoldenLayer, kGoldenLayer,
                      {name, reproduce(name), gradient}));
}

/// Runs an operator of x, weight and bias and compares the output and all gradients.
void expect_layer(vk::Context& context, const Golden& golden, const std::string& name,
                  const char* op, const Json& attributes) {
    OpCall call;
    call.op = op;
    call.attributes = attributes;
    call.inputs = {tensor(golden, name + ".x"), tensor(golden, name + ".p.weight"),
                   tensor(golden, name + ".p.bias")};
    call.grad_outputs = {tensor(golden, name + ".g")};
    const OpResult gpu = run_op(context, call);
    ASSERT_OK(gpu.status) << name;
    expect_close(golden, name + ".y64", gpu.outputs[0], false);
    expect_close(golden, name + ".d_x64", gpu.grad_inputs[0], true);
    expect_close(golden, name + ".d.weight64", gpu.grad_inputs[1], true);
    expect_close(golden, name + ".d.bias64", gpu.grad_inputs[2], true);
}

TEST_P(GoldenNetNorm, GroupNorm) {
    each_golden("norm", [&](const Golden& golden) {
        for (const std::string& name : cases(golden, "gn", {"gn0", "gn1", "gn2", "gn3", "gn4"})) {
            EXPECT_EQ(golden.array(name + ".cfg").ints().value().at(0), golden.dim(name + ".x", 1));
            expect_layer(context(), golden, name, "group_norm",
                         {{"groups", golden.array(name + ".cfg").ints().value().at(1)},
                          {"eps", golden.doubles(name + ".eps").at(0)}});
        }
    });
}

TEST_P(GoldenNetNorm, Linear) {
    each_golden("norm", [&](const Golden& golden) {
        for (const std::string& name : cases(golden, "lin", {"lin"}))
            expect_layer(context(), golden, name, "linear", Json::object());
    });
}

/// SiLU is fused into group_norm: with a constant input t is beta, so that y = silu(beta) and
/// grad_beta = g * silu'(beta).
TEST_P(GoldenNetNorm, Silu) {
    each_golden("norm", [&](const Golden& golden) {
        for (const std::string& name : cases(golden, "silu", {"silu"})) {
            const std::vector<float> x = golden.floats(name + ".x");
            const auto channels = static_cast<std::uint32_t>(x.size());
            const std::vector<float> ones(channels, 1);
            OpCall call;
            call.op = "group_norm";
            call.attributes = {{"groups", 1}, {"silu", true}};
            call.inputs = {{{1, channels, 1, 1}, ones}, {{channels}, ones}, {{channels}, x}};
            call.grad_outputs = {{{1, channels, 1, 1}, golden.floats(name + ".g")}};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            expect_close(golden, name + ".y64", gpu.outputs[0], false);
            expect_close(golden, name + ".d_x64", gpu.grad_inputs[2], true);
        }
    });
}

}  // namespace
}  // namespace splat::test
