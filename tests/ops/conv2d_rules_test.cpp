// What conv2d promises besides its values and what every operator does (every/op_samples_test.cpp):
// refusals, long sums, and the tensors of another implementation.
#include <gtest/gtest.h>

#include "conv2d_case.h"
#include "ops/conv2d.h"
#include "ops/conv2d_algorithm.h"
#include "support/golden_file.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

class Conv2dRules : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(Conv2dRules);

class Conv2dRulesPlain : public KernelsTest {};
INSTANTIATE_TEST_SUITE_P(Kernels, Conv2dRulesPlain, testing::Values(vk::Kernels::kPlain),
                         kernels_test_name);

TEST_P(Conv2dRulesPlain, ComputeDirectly) {
    Conv2dCase c = Conv2dCase::normal({2, 9, 9, 8, 15, 3}, 615);
    const OpResult direct = run_op(context(), c.call());
    c.winograd = 4;
    const OpResult asked = run_op(context(), c.call());
    ASSERT_OK(direct.status);
    ASSERT_OK(asked.status);
    EXPECT_EQ(direct.outputs, asked.outputs);
    EXPECT_EQ(direct.grad_inputs, asked.grad_inputs);
}

/// Tiles of 4 x 4 with 1024 channels have more weights than 128 MiB, with 1536 those of 2 x 2, too.
TEST_P(Conv2dRules, PreparedWeightsFitOneBinding) {
    const vk::Recorder recorder(context());
    const auto limit = context().device().info().limits.max_storage_buffer_bytes;
    const ops::OpRow& row = *need(ops::find_op("conv2d"));
    for (const std::uint32_t channels : {1024U, 1536U})
        for (const int winograd : {2, 4}) {
            const auto attributes = need(ops::complete_attributes(
                row, need(parse_flat_json(nlohmann::json{{"winograd", winograd}}.dump(), "test"))));
            const auto plan = need(row.plan(
                recorder, attributes,
                std::vector<Shape>{{1, channels, 32, 32}, {channels, channels, 3, 3}, {}, {}}));
            EXPECT_LE(plan.forward_prepared, limit) << channels;
            EXPECT_LE(plan.backward_prepared, limit) << channels;
        }
}

TEST_P(Conv2dRules, RejectsBadShapes) {
    const Conv2dCase good = Conv2dCase::normal({2, 3, 5, 4, 6, 3}, 630);
    const auto status = [&](const auto& change) {
        OpCall call = good.call();
        change(call);
        return run_op(context(), call).status;
    };
    EXPECT_OK(status([](OpCall&) {}));
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[0].shape = {2, 3, 20}; }), Code::kShape, "'x'");
    EXPECT_ERROR(status([](OpCall& c) { c.inputs[1].shape = {6, 27}; }), Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1].shape = {6, 3, 1, 9};
                 }),
                 Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1].shape = {3, 6, 3, 3};
                 }),
                 Code::kShape, "weight");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[1] = {{6, 3, 2, 2}, std::vector<float>(72)};
                 }),
                 Code::kInvalidArgument, "2 x 2");
    for (const int winograd : {-1, 1, 3, 6, 1000})
        EXPECT_ERROR(status([&](OpCall& c) { c.attributes["winograd"] = winograd; }),
                     Code::kInvalidArgument, "expected 0, or 2 or 4");
    for (const int precision : {-3, 4, 7})
        EXPECT_ERROR(status([&](OpCall& c) { c.attributes["precision"] = precision; }),
                     Code::kInvalidArgument,
                     "precision = " + std::to_string(precision) + ", expected 0 to 3");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.attributes["winograd"] = 4;
                     c.attributes["precision"] = 1;
                 }),
                 Code::kInvalidArgument, "winograd = 4 with precision = 1, which chooses it");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.attributes["winograd"] = 2;
                     c.inputs[1] = {{6, 3, 1, 1}, std::vector<float>(18)};
                 }),
                 Code::kInvalidArgument, "kernel of 1 x 1");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.attributes["replicate"] = true;
                     c.inputs[1] = {{6, 3, 1, 1}, std::vector<float>(18)};
                 }),
                 Code::kInvalidArgument, "replicate with a kernel of 1 x 1");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[2] = {{5}, std::vector<float>(5)};
                 }),
                 Code::kShape, "bias");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.inputs[3].shape = {2, 6, 4, 5};
                 }),
                 Code::kShape, "residual");
    EXPECT_ERROR(status([](OpCall& c) {
                     c.grad_outputs[0].shape = {2, 6, 4, 5};
                 }),
                 Code::kShape, "grad_y");
    EXPECT_ERROR(status([](OpCall& c) { c.attributes["stride"] = 2; }), Code::kInvalidArgument,
                 "stride");
}

/// conv.npz of tests/golden/net: cases without resampling.
TEST_P(Conv2dRules, GoldenLayers) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    each_golden("conv", [&](const Golden& golden) {
        std::vector<std::string> names = golden.cases("p.weight");
        std::erase_if(names, [&](const std::string& name) {
            return golden.dim(name + ".x", 2) != golden.dim(name + ".y", 2);
        });
        golden.expect_cases(names, {"c3", "c1"});
        for (const std::string& name : names) {
            Conv2dCase c;
            c.shape = {golden.dim(name + ".x", 0), golden.dim(name + ".x", 1),
                       golden.dim(name + ".x", 2), golden.dim(name + ".x", 3),
                       golden.dim(name + ".y", 1), golden.dim(name + ".p.weight", 2)};
            c.x = golden.floats(name + ".x");
            c.weight = golden.floats(name + ".p.weight");
            c.bias = golden.floats(name + ".p.bias");
            c.grad_y = golden.floats(name + ".g");
            const OpResult gpu = run_op(context(), c.call());
            ASSERT_OK(gpu.status) << name;
            const auto expect_close = [&](const std::string& key, const std::vector<float>& got) {
                EXPECT_TRUE(close(got, golden.doubles(name + key), kGoldenLayer, kGoldenLayer,
                                  {name + key, reproduce(name)}));
            };
            expect_close(".y64", gpu.outputs[0]);
            expect_close(".d_x64", gpu.grad_inputs[0]);
            expect_close(".d.weight64", gpu.grad_inputs[1]);
            expect_close(".d.bias64", gpu.grad_inputs[2]);
        }
    });
}

TEST(Conv2dCheck, RefusesWhatTheKernelsCannotTake) {
    const ops::Conv2dDesc good{
        .n = 8, .in_channels = 512, .height = 128, .width = 128, .out_channels = 256};
    EXPECT_OK(ops::conv2d_check(good));
    const auto refuses = [&](const auto& change, const char* text) {
        ops::Conv2dDesc desc = good;
        change(desc);
        EXPECT_ERROR(ops::conv2d_check(desc), Code::kUnsupported, text);
    };
    refuses([](ops::Conv2dDesc& d) { d.n = 1U << 16; }, "2^31");
    refuses([](ops::Conv2dDesc& d) { d.n = ~0U; }, "2^31");
    refuses([](ops::Conv2dDesc& d) { d.in_channels = 4097; }, "4097 -> 256 channels");
    refuses([](ops::Conv2dDesc& d) { d.out_channels = ~0U; }, "channels");
    refuses([](ops::Conv2dDesc& d) { d.width = 16385; }, "128 x 16385");
    refuses([](ops::Conv2dDesc& d) { d.height = ~0U; }, "at most 16384");
}

TEST(Conv2dAlgorithm, FollowsItsTable) {
    using enum ops::Conv2dPrecision;
    const auto choices = [](const ops::Conv2dDesc& desc) {
        std::vector<int> all;
        for (const ops::Conv2dPrecision precision : {kStrict, kBalanced, kFast}) {
            ops::Conv2dDesc chosen = desc;
            chosen.winograd = ops::conv2d_algorithm(desc, precision);
            EXPECT_OK(ops::conv2d_check(chosen));
            all.push_back(chosen.winograd);
        }
        return all;
    };
    using Choices = std::vector<int>;
    const auto layer = [](std::uint32_t in, std::uint32_t size, std::uint32_t out) {
        return ops::Conv2dDesc{
            .n = 1, .in_channels = in, .height = size, .width = size, .out_channels = out};
    };
    EXPECT_EQ(choices(layer(128, 128, 128)), (Choices{2, 4, 4}));
    EXPECT_EQ(choices(layer(512, 64, 256)), (Choices{2, 4, 4}));
    EXPECT_EQ(choices(layer(256, 32, 256)), (Choices{2, 4, 4}));
    EXPECT_EQ(choices(layer(256, 16, 256)), (Choices{2, 2, 4}));
    EXPECT_EQ(choices(layer(3, 128, 128)), (Choices{2, 4, 4}));
    EXPECT_EQ(choices(layer(128, 128, 9)), (Choices{2, 4, 4}));
    EXPECT_EQ(choices(layer(128, 128, 8)), (Choices{0, 0, 0}));
    EXPECT_EQ(choices(layer(128, 2, 128)), (Choices{0, 0, 0}));
    ops::Conv2dDesc point = layer(256, 64, 256);
    point.kernel = 1;
    EXPECT_EQ(choices(point), (Choices{0, 0, 0}));
}

}  // namespace
}  // namespace splat::test
