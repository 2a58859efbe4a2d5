// The head of F3D-Gaus against tensors of its published code.
#include <gtest/gtest.h>

#include "config/heads.h"
#include "model/camera_embedding.h"
#include "ops/gaussian_head.h"
#include "ops/op_harness.h"
#include "support/golden_file.h"

namespace splat::test {
namespace {

constexpr double kOutputs = 5e-6, kGradients = 2e-5;

class Nets2F3d : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Nets2F3d);

/// Numbers of a file, of any shape; float64 is rounded.
HostTensor shaped(const Golden& golden, const char* key, const Shape& shape) {
    const std::vector<double> values = golden.doubles(key);
    EXPECT_EQ(values.size(), shape.elements());
    return {shape, {values.begin(), values.end()}};
}

/// The network whose head a file is of.
config::ModelConfig network_of(const Golden& golden) {
    config::ModelConfig network;
    config::take_head(config::kHeads[1], network);
    network.resolution = golden.dim("raw", 2);
    network.fov_degrees = static_cast<float>(golden.doubles("fov").at(0));
    network.views = golden.dim("raw", 0);
    return network;
}

/// The first coefficient of each Gaussian's colours, then the other three.
template <class T>
std::vector<T> joined_sh(const std::vector<T>& dc, const std::vector<T>& rest) {
    std::vector<T> sh;
    for (std::size_t g = 0; g < dc.size() / 3; ++g) {
        for (std::size_t i = 0; i < 3; ++i) sh.push_back(dc[3 * g + i]);
        for (std::size_t i = 0; i < 9; ++i) sh.push_back(rest[9 * g + i]);
    }
    return sh;
}

OpCall call_of(const Golden& golden) {
    const config::ModelConfig network = network_of(golden);
    const std::uint32_t n = network.views, r = network.resolution;
    const auto tensor = [&](const char* name) { return golden_tensor(golden.npz, name); };
    OpCall call;
    call.op = "gaussian_head";
    for (const JsonScalar& one : ops::gaussian_head_attributes(network.head(), network.views))
        std::visit([&](const auto& value) { call.attributes[one.name] = value; }, one.value);
    call.inputs = {tensor("raw"),
                   {{3, r, r}, model::pixel_rays(network)},
                   shaped(golden, "view_to_world_rows", {n, 4, 4}),
                   shaped(golden, "cv2wT_quat", {n, 4}),
                   {},
                   shaped(golden, "depth", {n, r, r})};
    call.grad_outputs = {tensor("grad_out.xyz"),
                         tensor("grad_out.opacity"),
                         tensor("grad_out.scaling"),
                         tensor("grad_out.rotation"),
                         {{1, n * r * r, 4, 3},
                          joined_sh(golden.floats("grad_out.features_dc"),
                                    golden.floats("grad_out.features_rest"))}};
    return call;
}

TEST_P(Nets2F3d, GoldenHead) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    for (const std::string& path : golden_files("nets2", "f3d")) {
        const Golden golden{need(Npz::read(path)), golden_name(path)};
        const OpResult gpu = run_op(context(), call_of(golden));
        ASSERT_OK(gpu.status) << path;
        const char* const names[] = {"xyz", "opacity", "scaling", "rotation"};
        for (std::size_t i = 0; i < std::size(names); ++i)
            expect_relative(names[i], gpu.outputs[i],
                            golden.doubles(std::string("out.") + names[i]), kOutputs);
        expect_relative(
            "sh", gpu.outputs[4],
            joined_sh(golden.doubles("out.features_dc"), golden.doubles("out.features_rest")),
            kOutputs);
        expect_relative("raw", gpu.grad_inputs[0], golden.doubles("grad.raw"), kGradients);
    }
}

}  // namespace
}  // namespace splat::test
