// What group_norm promises besides its figures: reproducibility, padding, aliasing, limits, errors.
#include <gtest/gtest.h>

#include <limits>

#include "group_norm_case.h"
#include "ops/group_norm.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

class GroupNormRules : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GroupNormRules);

TEST(GroupNormReference, GradcheckFloat64) {
    std::uint64_t seed = 600;
    for (const NormShape& shape : {NormShape{2, 6, 2, 3, 3}, NormShape{1, 4, 1, 2, 1},
                                   NormShape{3, 2, 3, 1, 2}, NormShape{1, 8, 2, 2, 2}})
        for (const bool silu : {false, true})
            expect_gradcheck(GroupNormCase(shape, silu, ++seed).call());
}

std::vector<std::vector<float>> all_tensors(const OpResult& result) {
    std::vector<std::vector<float>> all = result.outputs;
    all.insert(all.end(), result.saved.begin(), result.saved.end());
    all.insert(all.end(), result.grad_inputs.begin(), result.grad_inputs.end());
    return all;
}

TEST_P(GroupNormRules, BitEqualOverRunsAndPoison) {
    for (const NormShape& shape : {NormShape{2, 9, 9, 8, 3}, NormShape{2, 32, 15, 17, 8}}) {
        GroupNormCase c(shape, true, 700);
        std::vector<std::vector<float>> first;
        for (const std::uint32_t pattern : kPoisonPatterns) {
            vk::Context* poisoned = poisoned_context(GetParam(), pattern);
            ASSERT_NE(poisoned, nullptr);
            for (const int runs : {1, 3}) {
                OpCall call = c.call();
                call.runs = runs;
                const OpResult gpu = run_op(*poisoned, call);
                ASSERT_OK(gpu.status);
                const auto all = all_tensors(gpu);
                if (first.empty()) first = all;
                for (std::size_t i = 0; i < all.size(); ++i)
                    EXPECT_TRUE(bit_equal(first[i], all[i],
                                          {"tensor " + std::to_string(i), reproduce(c.text())}));
            }
        }
    }
}

TEST_P(GroupNormRules, AccumulateAddsToParameterGradients) {
    for (const NormShape& shape : {NormShape{2, 6, 3, 5, 3}, NormShape{2, 16, 8, 8, 4}}) {
        const GroupNormCase c(shape, true, 710);
        OpCall call = c.call();
        const OpResult plain = run_op(context(), call);
        ASSERT_OK(plain.status);
        call.accumulate_to = {std::vector<float>(shape.elements(), 9), normal_fill(shape.C, 1),
                              normal_fill(shape.C, 2)};
        const OpResult added = run_op(context(), call);
        ASSERT_OK(added.status);
        const std::string how = reproduce(c.text());
        EXPECT_TRUE(bit_equal(added.grad_inputs[0], plain.grad_inputs[0], {"grad_x", how}));
        for (const std::size_t parameter : {1U, 2U})
            for (std::size_t i = 0; i < shape.C; ++i)  // one rounding of the sum
                EXPECT_FLOAT_EQ(added.grad_inputs[parameter][i],
                                plain.grad_inputs[parameter][i] + call.accumulate_to[parameter][i])
                    << how;
    }
}

/// Runs the operator itself, on quads, out of place or in place; returns the raw quads of y and
/// grad_x.
std::vector<std::vector<float>> run_on_quads(vk::Context& context, const GroupNormCase& c,
                                             bool in_place) {
    const NormShape& s = c.shape;
    const ops::GroupNormDesc desc{{s.N, s.C, s.H * s.W}, s.G, c.eps, c.silu};
    const std::size_t quads = desc.x.bytes() / 4;
    const Shape nchw{s.N, s.C, s.H, s.W};
    const auto quad_view = [&](const vk::Buffer& buffer) {
        vk::BufferView view = buffer.range();
        view.shape = nchw;
        return view;
    };
    const vk::Buffer host_x = upload(context, c.x);
    const vk::Buffer host_grad = upload(context, c.grad_y);
    const vk::Buffer gamma = upload(context, c.gamma);
    const vk::Buffer beta = upload(context, c.beta);
    const vk::Buffer x = device_buffer(context, quads);
    const vk::Buffer grad_y = device_buffer(context, quads);
    const vk::Buffer other_y = device_buffer(context, quads);
    const vk::Buffer other_grad = device_buffer(context, quads);
    const vk::Buffer mean = device_buffer(context, std::size_t{2} * s.N * s.G);
    const vk::Buffer rstd = device_buffer(context, std::size_t{s.N} * s.G);
    const vk::Buffer grad_gamma = device_buffer(context, s.C);
    const vk::Buffer grad_beta = device_buffer(context, s.C);
    const vk::Buffer sums = device_buffer(context, ops::group_norm_sums_bytes(desc) / 4);
    const vk::BufferView y = quad_view(in_place ? x : other_y);
    const vk::BufferView grad_x = quad_view(in_place ? grad_y : other_grad);

    vk::Recorder r(context);
    EXPECT_OK(ops::quads_pack(r, host_x.view(nchw), quad_view(x)));
    EXPECT_OK(ops::quads_pack(r, host_grad.view(nchw), quad_view(grad_y)));
    EXPECT_OK(ops::group_norm_forward(r, desc, quad_view(x), gamma.view({s.C}), beta.view({s.C}), y,
                                      mean.view({2, s.N, s.G}), rstd.view({s.N, s.G})));
    if (in_place) {
        EXPECT_OK(ops::quads_pack(r, host_x.view(nchw), quad_view(other_y)));
    }
    EXPECT_OK(ops::group_norm_backward(
        r, desc, quad_view(in_place ? other_y : x), gamma.view({s.C}), beta.view({s.C}),
        mean.view({2, s.N, s.G}), rstd.view({s.N, s.G}), quad_view(grad_y), grad_x,
        grad_gamma.view({s.C}), grad_beta.view({s.C}), sums.range(), false));
    vk::CommandList list = std::move(r.finish().value());
    EXPECT_OK(context.run(list));
    return {download(context, y, quads), download(context, grad_x, quads)};
}

TEST_P(GroupNormRules, EachGradientAlone) {
    for (const NormShape& shape : {NormShape{2, 6, 3, 5, 3}, NormShape{2, 16, 8, 8, 4}})
        expect_each_gradient_alone(context(), GroupNormCase(shape, true, 715).call());
}

TEST_P(GroupNormRules, InPlaceEqualsOutOfPlace) {
    for (const NormShape& shape : {NormShape{2, 9, 5, 7, 3}, NormShape{2, 32, 15, 17, 8}})
        for (const bool silu : {false, true}) {
            const GroupNormCase c(shape, silu, 720);
            const auto apart = run_on_quads(context(), c, false);
            const auto in_place = run_on_quads(context(), c, true);
            EXPECT_TRUE(bit_equal(apart[0], in_place[0], {"y", reproduce(c.text())}));
            EXPECT_TRUE(bit_equal(apart[1], in_place[1], {"grad_x", reproduce(c.text())}));
        }
}

TEST_P(GroupNormRules, PaddedChannelsStayZero) {
    for (const NormShape& shape : {NormShape{2, 9, 5, 7, 3}, NormShape{1, 6, 3, 3, 1},
                                   NormShape{1, 7, 1, 1, 1}, NormShape{3, 5, 2, 2, 5}}) {
        const GroupNormCase c(shape, true, 730);
        const auto quads = run_on_quads(context(), c, false);
        const std::size_t columns = std::size_t{shape.N} * shape.H * shape.W;
        for (const auto& tensor : quads)
            for (std::size_t i = 0; i < tensor.size(); ++i) {
                const std::size_t channel = i / 4 / columns * 4 + i % 4;
                if (channel >= shape.C) {
                    EXPECT_EQ(tensor[i], 0) << c.text() << " at " << i;
                }
            }
    }
}

TEST(GroupNormLimits, WorksOnTheLeastDeviceVulkanAllows) {
    vk::ContextDesc desc = context_desc();
    desc.device.fake = [](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 1U << 27;
        info.limits.max_texel_elements = 65536;
        info.limits.max_groups = {65535, 65535, 65535};
        info.limits.max_group_size = {128, 128, 64};
        info.limits.max_group_invocations = 128;
        info.limits.shared_memory_bytes = 16384;
        info.limits.push_constant_bytes = 128;
        info.limits.subgroup_size = 1;
        info.limits.offset_alignment = 256;
        info.features = {};
    };
    const auto context = make_context(desc);
    ASSERT_NE(context, nullptr);
    EXPECT_EQ(context->device().kernels(), vk::Kernels::kPlain);
    for (const NormShape& shape : {NormShape{2, 9, 9, 8, 3}, NormShape{1, 32, 15, 17, 8}}) {
        const GroupNormCase c(shape, true, 740);
        const OpResult gpu = run_op(*context, c.call());
        ASSERT_OK(gpu.status);
        EXPECT_TRUE(matches(gpu.outputs[0], ref::group_norm_forward(c.reference()).y,
                            tolerance("group_norm", "y"), {"y", reproduce(c.text())}));
    }
}

/// Two attempts and the output loop five times over a group; lavapipe ends loops after 65535 turns in all.
TEST_P(GroupNormRules, LargeGroupsAreWholeWhereSquaresOverflow) {
    GroupNormCase c({1, 1, 1000, 1000, 1}, false, 745);
    for (float& x : c.x) x *= 1e25F;
    OpCall call = c.call();
    call.grad_outputs.clear();
    const OpResult gpu = run_op(context(), call);
    ASSERT_OK(gpu.status);
    EXPECT_TRUE(matches(gpu.outputs[0], ref::group_norm_forward(c.reference()).y,
                        tolerance("group_norm", "y"), {"y", reproduce(c.text())}));
}

TEST_P(GroupNormRules, RefusesGroupsThatLoopsCannotWalk) {
    if (context().device().info().kind != vk::DeviceKind::kCpu) GTEST_SKIP() << "only CPU devices";
    for (const bool many : {false, true}) {
        const GroupNormCase c({1, many ? 4097U : 4096U, 1, 2, 1}, true, 746);
        const OpResult gpu = run_op(context(), c.call());
        if (many) {
            EXPECT_ERROR(gpu.status, Code::kUnsupported, "a group of 4097 channels");
            continue;
        }
        ASSERT_OK(gpu.status);
        EXPECT_TRUE(matches(gpu.outputs[0], ref::group_norm_forward(c.reference()).y,
                            tolerance("group_norm", "y"), {"y", reproduce(c.text())}));
    }
}

TEST_P(GroupNormRules, RejectsBadShapesAndAttributes) {
    const GroupNormCase good({2, 6, 3, 5, 3}, false, 750);
    const auto status = [&](const auto& change) {
        OpCall call = good.call();
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["groups"] = 4; }), Code::kShape, "4 groups");
    for (const std::int64_t groups : {std::int64_t{0}, std::int64_t{-1}, std::int64_t{7},
                                      std::numeric_limits<std::int64_t>::max()})
        EXPECT_ERROR(status([&](OpCall& c) { c.attributes["groups"] = groups; }),
                     Code::kInvalidArgument, "groups");
    for (const double eps : {0.0, -1e-5, 1e300, 1e-300})
        EXPECT_ERROR(status([&](OpCall& c) { c.attributes["eps"] = eps; }), Code::kInvalidArgument,
                     "eps");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["epsilon"] = 1; }), Code::kInvalidArgument,
                 "epsilon");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["silu"] = 1; }), Code::kInvalidArgument,
                 "silu");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["groups"] = 1.5; }), Code::kInvalidArgument,
                 "groups");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1] = {{5}, std::vector<float>(5, 1)};
                 }),
                 Code::kShape, "gamma");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[2] = {{6, 1}, std::vector<float>(6, 1)};
                 }),
                 Code::kShape, "beta");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[0] = {{6}, std::vector<float>(6, 1)};
                 }),
                 Code::kShape, "[6]");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.grad_outputs[0].shape = {2, 6, 5, 3};
                 }),
                 Code::kShape, "grad_y");
}

TEST_P(GroupNormRules, AbsentRequiredInputIsAnError) {
    const GroupNormCase good({2, 6, 3, 5, 3}, false, 760);
    for (std::size_t i = 0; i < 3; ++i) {
        OpCall call = good.call();
        call.inputs[i].values.clear();
        call.grad_outputs.clear();
        EXPECT_FALSE(run_op(context(), call).status.ok()) << i;
    }
}

}  // namespace
}  // namespace splat::test
