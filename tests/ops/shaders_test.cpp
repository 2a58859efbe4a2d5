// All embedded modules: what their SPIR-V says against what the house rules and the hosts say.
#include "vk/shaders.h"

#include <gtest/gtest.h>

#include <set>

#include "ops/conv2d.h"
#include "ops/group_norm.h"
#include "ops/linear.h"
#include "ops/strided_copy.h"
#include "ops/tensor_stats.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/raster_shader.h"
#include "vk/spirv.h"

namespace splat::test {
namespace {

TEST(Shaders, TableIsUniqueAndReadable) {
    std::set<std::string_view> names;
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        EXPECT_TRUE(names.insert(module.name).second) << module.name;
        EXPECT_EQ(std::string_view(module.sha256).size(), 64U) << module.name;
        const auto interface = vk::reflect(module.words);
        ASSERT_OK(interface.status()) << module.name;
        EXPECT_FALSE(interface.value().bindings.empty()) << module.name;
        EXPECT_LE(interface.value().push_bytes, vk::PushData::kMaxBytes) << module.name;
    }
    EXPECT_GE(names.size(), 16U);
}

TEST(Shaders, AreReproducibleAndSplittable) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const vk::ShaderInterface interface = vk::reflect(module.words).value();
        EXPECT_FALSE(interface.uses_float_atomics)
            << module.name << ": sums would depend on timing";
        EXPECT_FALSE(interface.uses_num_workgroups) << module.name << " could not be split";
    }
}

/// Where the plain kernel serves GPUs well, there is none for them (LOADS and CPU in shaders/README.md).
TEST(Shaders, FastOnesHaveAPlainTwin) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const std::string name = module.name;
        if (!name.ends_with("_cpu") && !name.ends_with("_gpu")) continue;
        const std::string stem = name.substr(0, name.size() - 4);
        EXPECT_NE(vk::find_shader(stem), nullptr) << name << " has no plain twin";
        EXPECT_NE(vk::find_shader(stem + "_cpu"), nullptr) << name;
    }
}

/// Collects the shaders that a set of kernels uses; recording checks each declaration against the
/// shader.
class Uses {
  public:
    explicit Uses(vk::Context& context) : context_(context), recorder_(context) {}

    vk::BufferView view(const Shape& shape, std::uint64_t elements) {
        buffers_.push_back(device_buffer(context_, elements));
        vk::BufferView result = buffers_.back().range();
        result.shape = shape;
        return result;
    }
    vk::BufferView row(std::uint32_t n) { return view({n}, n); }

    void group_norm(std::uint32_t channels) {
        const ops::GroupNormDesc desc{{1, channels, 6}, 2, 1e-5F, true};
        const Shape shape{1, channels, 6};
        const auto quads = [&] { return view(shape, desc.x.bytes() / 4); };
        const vk::BufferView x = quads();
        const vk::BufferView gamma = row(channels);
        const vk::BufferView mean = row(2);
        const vk::BufferView rstd = row(2);
        EXPECT_OK(ops::group_norm_forward(recorder_, desc, x, gamma, gamma, quads(), mean, rstd));
        EXPECT_OK(ops::group_norm_backward(recorder_, desc, x, gamma, gamma, mean, rstd, quads(),
                                           quads(), row(channels), row(channels), row(2 * channels),
                                           false));
    }

    void conv2d(std::int32_t winograd) {
        const ops::Conv2dDesc desc{.n = 2,
                                   .in_channels = 5,
                                   .height = 3,
                                   .width = 3,
                                   .out_channels = 6,
                                   .winograd = winograd};
        const vk::BufferView weight = row(270);
        const vk::BufferView prepared = row(1U << 16);
        const vk::BufferView workspace = row(1U << 20);
        const auto x = [&] { return view({2, 5, 3, 3}, 144); };
        const auto y = [&] { return view({2, 6, 3, 3}, 144); };
        EXPECT_OK(ops::conv2d_prepare_weight(recorder_, desc, weight, prepared, false));
        EXPECT_OK(ops::conv2d_forward(recorder_, desc, x(), prepared, row(6), y(), y(), workspace));
        EXPECT_OK(ops::conv2d_backward_input(recorder_, desc, prepared, y(), x(), workspace));
        EXPECT_OK(
            ops::conv2d_backward_weight(recorder_, desc, x(), y(), row(270), workspace, false));
        EXPECT_OK(ops::conv2d_backward_residual(recorder_, desc, y(), y()));
    }

    void linear() {
        const ops::LinearDesc desc{8, 8, 8, true};
        const vk::BufferView weight = row(1024);
        const vk::BufferView packed = row(1024);
        const auto rows = [&] { return view({8, 8}, 64); };
        EXPECT_OK(ops::linear_pack_weight(recorder_, desc, weight, packed, false));
        EXPECT_OK(ops::linear_pack_weight(recorder_, desc, weight, packed, true));
        EXPECT_OK(ops::linear_forward(recorder_, desc, rows(), packed, row(8), rows()));
        EXPECT_OK(ops::linear_backward_input(recorder_, desc, packed, rows(), rows()));
        EXPECT_OK(ops::linear_backward_weight(recorder_, desc, rows(), rows(), row(64), row(1024),
                                              false));
        EXPECT_OK(ops::linear_backward_bias(recorder_, desc, rows(), row(8), false));
    }

    void rest() {
        EXPECT_OK(ops::strided_copy(recorder_, {4, 1, {1, 0}, {1, 0}, false}, row(4), row(4)));
        EXPECT_OK(ops::quads_pack(recorder_, view({2, 4}, 8), view({2, 4}, 8)));
        EXPECT_OK(ops::quads_unpack(recorder_, view({2, 4}, 8), view({2, 4}, 8)));
        EXPECT_OK(ops::tensor_stats(recorder_, 8, row(8), row(8)));
    }

    std::set<std::string> shaders() {
        std::set<std::string> names;
        const auto list = recorder_.finish();
        EXPECT_OK(list.status());
        for (const vk::Command& command : list.value().commands())
            if (command.kind == vk::CommandKind::kDispatch) names.insert(command.shader);
        return names;
    }

  private:
    vk::Context& context_;
    vk::Recorder recorder_;
    std::vector<vk::Buffer> buffers_;
};

TEST(Shaders, EveryModuleIsUsedAsDeclared) {
    std::set<std::string> used;
    for (const vk::Kernels kernels : kernels_to_test()) {
        vk::Context* context = shared_context(kernels);
        ASSERT_NE(context, nullptr);
        Uses uses(*context);
        uses.conv2d(0);
        uses.conv2d(4);
        uses.group_norm(8);
        uses.group_norm(6);
        uses.linear();
        uses.rest();
        used.merge(uses.shaders());
    }
    if (kernels_to_test().size() < 3) GTEST_SKIP() << "this device runs plain kernels only";
    for (const vk::ShaderModule& module : vk::shader_modules())
        EXPECT_TRUE(is_raster_shader(module.name) || used.contains(module.name))
            << module.name << " is built in, but nothing uses it";
}

}  // namespace
}  // namespace splat::test
