// Layers of golden/net/norm*.npz, computed once with PyTorch; see tests/golden/net/README.md for
// the keys.
#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "support/golden.h"
#include "support/npz.h"

namespace splat::test {
namespace {

/// Figure of golden/net/INDEX.md for layers: the reference's own float32 run stays within it, too.
constexpr double kLayer = 1e-5;

class GoldenNetNorm : public KernelsTest {
  protected:
    void SetUp() override {
        SPLAT_NEEDS_GOLDEN_FOLDER();
        KernelsTest::SetUp();
    }
};
SPLAT_INSTANTIATE_KERNELS(GoldenNetNorm);

const NpyArray& array(const Npz& npz, const std::string& name) {
    static const NpyArray none;
    const auto found = npz.find(name);
    EXPECT_TRUE(found.ok()) << found.status().message();
    return found.ok() ? *found.value() : none;
}

HostTensor tensor(const Npz& npz, const std::string& name) {
    const NpyArray& from = array(npz, name);
    const std::vector<std::int64_t> dims(from.shape.begin(), from.shape.end());
    return {Shape::create(dims, name).value(), from.f32().value()};
}

/// Names `<prefix>...` of the cases that have a tensor x.
std::vector<std::string> cases(const Npz& npz, const std::string& prefix) {
    std::vector<std::string> found;
    for (const std::string& name : npz.names())
        if (name.starts_with(prefix) && name.ends_with(".x"))
            found.push_back(name.substr(0, name.size() - 2));
    return found;
}

void expect_close(const Npz& npz, const std::string& name, const std::vector<float>& gpu,
                  bool gradient) {
    EXPECT_TRUE(close(gpu, array(npz, name).f64().value(), kLayer, kLayer,
                      {name, reproduce(name), gradient}));
}

void expect_gradients(const Npz& npz, const std::string& name, const OpResult& gpu) {
    expect_close(npz, name + ".y64", gpu.outputs[0], false);
    expect_close(npz, name + ".d_x64", gpu.grad_inputs[0], true);
    expect_close(npz, name + ".d.weight64", gpu.grad_inputs[1], true);
    expect_close(npz, name + ".d.bias64", gpu.grad_inputs[2], true);
}

TEST_P(GoldenNetNorm, GroupNorm) {
    for (const std::string& path : golden_files("net", "norm")) {
        const auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        const auto names = cases(npz.value(), "gn");
        EXPECT_FALSE(names.empty()) << path;
        for (const std::string& name : names) {
            OpCall call;
            call.op = "group_norm";
            call.attributes = {{"groups", array(npz.value(), name + ".cfg").ints().value().at(1)},
                               {"eps", array(npz.value(), name + ".eps").f64().value().at(0)}};
            call.inputs = {tensor(npz.value(), name + ".x"),
                           tensor(npz.value(), name + ".p.weight"),
                           tensor(npz.value(), name + ".p.bias")};
            call.grad_outputs = {tensor(npz.value(), name + ".g")};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            expect_gradients(npz.value(), name, gpu);
        }
    }
}

TEST_P(GoldenNetNorm, Linear) {
    for (const std::string& path : golden_files("net", "norm")) {
        const auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        const auto names = cases(npz.value(), "lin");
        EXPECT_FALSE(names.empty()) << path;
        for (const std::string& name : names) {
            OpCall call;
            call.op = "linear";
            call.inputs = {tensor(npz.value(), name + ".x"),
                           tensor(npz.value(), name + ".p.weight"),
                           tensor(npz.value(), name + ".p.bias")};
            call.grad_outputs = {tensor(npz.value(), name + ".g")};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            expect_gradients(npz.value(), name, gpu);
        }
    }
}

/// SiLU is fused into group_norm: with a constant input t is beta, so that y = silu(beta) and
/// grad_beta = g * silu'(beta).
TEST_P(GoldenNetNorm, Silu) {
    for (const std::string& path : golden_files("net", "norm")) {
        const auto npz = Npz::read(path);
        ASSERT_OK(npz.status());
        const auto names = cases(npz.value(), "silu");
        EXPECT_FALSE(names.empty()) << path;
        for (const std::string& name : names) {
            const std::vector<float> x = tensor(npz.value(), name + ".x").values;
            const auto channels = static_cast<std::uint32_t>(x.size());
            const std::vector<float> ones(channels, 1);
            OpCall call;
            call.op = "group_norm";
            call.attributes = {{"groups", 1}, {"silu", true}};
            call.inputs = {{{1, channels, 1, 1}, ones}, {{channels}, ones}, {{channels}, x}};
            call.grad_outputs = {{{1, channels, 1, 1}, tensor(npz.value(), name + ".g").values}};
            const OpResult gpu = run_op(context(), call);
            ASSERT_OK(gpu.status) << name;
            expect_close(npz.value(), name + ".y64", gpu.outputs[0], false);
            expect_close(npz.value(), name + ".d_x64", gpu.grad_inputs[2], true);
        }
    }
}

}  // namespace
}  // namespace splat::test
