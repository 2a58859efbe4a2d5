// All embedded modules: their SPIR-V against the house rules and the declarations of the host.
#include "vk/shaders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "gaussians/plane_loss.h"
#include "gaussians/set_statistics.h"
#include "ops/adam.h"
#include "ops/ema.h"
#include "ops/gather_rows.h"
#include "ops/op_harness.h"
#include "ops/quads.h"
#include "ops/strided_copy.h"
#include "ops/tensor_stats.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/raster_shader.h"
#include "support/require_vulkan.h"
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

/// A Raspberry Pi's driver, V3DV, binds no more.
constexpr std::ptrdiff_t kMostStorageBuffers = 8;

TEST(Shaders, BindFewStorageBuffers) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const vk::ShaderInterface interface = vk::reflect(module.words).value();
        EXPECT_LE(std::ranges::count(interface.bindings, vk::DescriptorType::kStorageBuffer,
                                     &vk::ShaderBinding::type),
                  kMostStorageBuffers)
            << module.name;
    }
}

TEST(Shaders, AreReproducibleAndSplittable) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const vk::ShaderInterface interface = vk::reflect(module.words).value();
        EXPECT_FALSE(interface.uses_float_atomics)
            << module.name << ": sums would depend on timing";
        EXPECT_FALSE(interface.uses_num_workgroups) << module.name << " could not be split";
    }
}

/// Where the plain kernel is fast enough on GPUs, they have no kernel of their own (LOADS and CPU
/// in shaders/README.md).
TEST(Shaders, FastOnesHaveAPlainTwin) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const std::string name = module.name;
        if (!name.ends_with("_cpu") && !name.ends_with("_gpu")) continue;
        if (name == "tile_ranges_ordered_cpu") continue;      // tile_ranges, and an order of work
        if (name == "attention_forward_fused_cpu") continue;  // the steps of attention, as one
        const std::string stem = name.substr(0, name.size() - 4);
        const bool winograd =
            stem.starts_with("conv2d_winograd");  // plain kernels compute directly
        EXPECT_TRUE(winograd || vk::find_shader(stem) != nullptr) << name << " has no plain twin";
        const bool plain_on_cpus = stem == "tile_bin_scan";  // one invocation, where there are few
        EXPECT_TRUE(plain_on_cpus || vk::find_shader(stem + "_cpu") != nullptr) << name;
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

    vk::BufferView tensor(const Shape& shape, const ops::Port& port) {
        if (shape.rank() == 0) return {};
        const bool quads = port.layout == ops::Layout::kQuads;
        return view(shape, quads ? ops::quad_dims(shape).value().bytes() / 4 : shape.elements());
    }

    void row(const OpCall& call) {
        std::vector<Shape> shapes;
        for (const HostTensor& input : call.inputs)
            shapes.push_back(input.values.empty() ? Shape{} : input.shape);
        row(call.op, call.attributes.dump(), shapes);
    }

    /// Both passes as the op table's row records them, on tensors without content.
    void row(const std::string& op, const std::string& given, const std::vector<Shape>& shapes) {
        const ops::OpRow& row = *ops::find_op(op).value();
        const auto attributes =
            ops::complete_attributes(row, parse_flat_json(given, "attributes").value());
        const ops::OpPlan plan = row.plan(recorder_, attributes.value(), shapes).value();
        ops::OpViews v;
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            v.inputs.push_back(tensor(shapes[i], row.inputs[i]));
            v.grad_inputs.push_back(row.inputs[i].constant ? vk::BufferView{}
                                                           : tensor(shapes[i], row.inputs[i]));
        }
        for (std::size_t i = 0; i < plan.outputs.size(); ++i) {
            v.outputs.push_back(tensor(plan.outputs[i], row.outputs[i]));
            v.grad_outputs.push_back(tensor(plan.outputs[i], row.outputs[i]));
        }
        for (const Shape& shape : plan.saved) v.saved.push_back(view(shape, shape.elements()));
        const auto reserve = [&](std::uint64_t bytes) {
            return bytes == 0 ? vk::BufferView{} : view({}, bytes / 4);
        };
        v.workspace = reserve(std::max(plan.forward_workspace, plan.backward_workspace));
        v.forward_prepared = reserve(plan.forward_prepared);
        v.backward_prepared = reserve(plan.backward_prepared);
        if (row.prepare != nullptr) {
            EXPECT_OK(row.prepare(recorder_, attributes.value(), v, ops::Pass::kForward));
            EXPECT_OK(row.prepare(recorder_, attributes.value(), v, ops::Pass::kBackward));
        }
        EXPECT_OK(row.forward(recorder_, attributes.value(), v)) << op;
        EXPECT_OK(row.backward(recorder_, attributes.value(), v)) << op;
    }

    void rest() {
        // In blocks of queries, with heads that have a fused kernel on CPUs and with larger ones.
        for (const std::uint32_t channels : {4U, 128U})
            row("attention", "{}", std::vector<Shape>(3, Shape{1, channels, 2100}));
        for (const std::uint32_t stride : {1U, 2U})  // without gaps in y and with them
            EXPECT_OK(
                ops::strided_copy(recorder_, {4, 1, {1, 0}, {stride, 0}, false}, row(4), row(8)));
        EXPECT_OK(ops::adam(recorder_, {row(8)}, row(8), row(8), row(8), row(8)));
        EXPECT_OK(ops::ema(recorder_, row(4), row(8), row(8)));
        ops::StepDecision decision;
        decision.partial = row(8);
        decision.notes = row(4);
        decision.inputs = row(16);
        decision.history = row(8);
        decision.scalars = row(12);
        decision.ema_at = 32;
        EXPECT_OK(ops::step_decision(recorder_, decision));
        EXPECT_OK(ops::quads_pack(recorder_, view({2, 4}, 8), view({2, 4}, 8)));
        EXPECT_OK(ops::quads_pack_levels(recorder_, view({2, 4}, 2), view({2, 4}, 8)));
        EXPECT_OK(ops::quads_unpack(recorder_, view({2, 4}, 8), view({2, 4}, 8)));
        EXPECT_OK(ops::tensor_stats(recorder_, 8, row(8), row(8)));
        EXPECT_OK(ops::gather_rows(recorder_, {2, 4}, row(2), row(8), row(8), row(8)));
        const gaussians::SetDesc set{2, 0, false};
        const gaussians::SetViews views{row(24), row(8), set.gaussians};
        EXPECT_OK(gaussians::set_statistics(
            recorder_, set, views,
            view({}, gaussians::set_statistics_bytes(set.gaussians) / sizeof(float))));
        const gaussians::PlaneViews planes{row(2), row(2), row(4), row(1), row(1), 1, 2};
        EXPECT_OK(gaussians::plane_loss_forward(recorder_, views, planes, row(1)));
        EXPECT_OK(gaussians::plane_loss_backward(recorder_, views, planes, row(4),
                                                 {row(24), row(8), set.gaussians}));
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
        for (const OpCall& call : op_samples()) uses.row(call);
        uses.rest();
        used.merge(uses.shaders());
    }
    if (kernels_to_test().size() < 3)
        SPLAT_SKIP_FOR_DEVICE("this device does not run all sets of kernels");
    for (const vk::ShaderModule& module : vk::shader_modules())
        EXPECT_TRUE(is_raster_shader(module.name) || is_fit_shader(module.name) ||
                    is_triangle_shader(module.name) || used.contains(module.name))
            << module.name << " is built in, but nothing uses it";
}

}  // namespace
}  // namespace splat::test
