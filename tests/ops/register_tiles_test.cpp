// The CPU, or the driver of a GPU, decides the register tiles, its shared memory those of products, the CPU the form of
// stores too. Whatever it decides, the order of sums is the same.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <span>

#include "conv2d_case.h"
#include "support/gpu_env.h"

namespace splat::test {
namespace {

OpCall linear_call(const MatrixShape& s, std::uint64_t seed) {
    OpCall call;
    call.op = "linear";
    call.inputs = {{{s.rows, s.in}, normal_fill(std::size_t{s.rows} * s.in, seed)},
                   {{s.out, s.in}, normal_fill(std::size_t{s.out} * s.in, seed + 1)},
                   {{s.out}, normal_fill(s.out, seed + 2)}};
    call.grad_outputs = {{{s.rows, s.out}, normal_fill(std::size_t{s.rows} * s.out, seed + 3)}};
    return call;
}

OpCall attention_call(std::array<std::uint32_t, 3> s, std::uint64_t seed) {
    const std::size_t count = std::size_t{s[0]} * s[1] * s[2];
    OpCall call;
    call.op = "attention";
    for (std::uint64_t i = 0; i < 3; ++i)
        call.inputs.push_back({{s[0], s[1], s[2]}, normal_fill(count, seed + i)});
    call.grad_outputs = {{{s[0], s[1], s[2]}, normal_fill(count, seed + 3)}};
    return call;
}

/// All calls have the bits of the first context in each other one.
void expect_same_bits(vk::Kernels kernels,
                      std::span<const std::function<void(vk::DeviceInfo&)>> kinds,
                      const std::vector<OpCall>& calls) {
    std::vector<std::shared_ptr<vk::Context>> contexts;
    for (const auto& kind : kinds) {
        vk::ContextDesc desc = context_desc(kernels);
        desc.device.fake = kind;
        contexts.push_back(make_context(desc));
        ASSERT_NE(contexts.back(), nullptr);
    }
    for (const OpCall& call : calls) {
        const OpResult expected = run_op(*contexts[0], call);
        ASSERT_OK(expected.status);
        for (std::size_t kind = 1; kind < contexts.size(); ++kind) {
            const OpResult got = run_op(*contexts[kind], call);
            ASSERT_OK(got.status);
            EXPECT_EQ(got.outputs, expected.outputs) << call.op << ", kind " << kind;
            EXPECT_EQ(got.grad_inputs, expected.grad_inputs) << call.op << ", kind " << kind;
        }
    }
}

std::vector<OpCall> product_calls() {
    std::vector<OpCall> calls;
    // 64 tiles of F(4x4), 240 or 256 of F(2x2): enough for wide tiles; then 3 and 9 of F(4x4), no eights.
    for (const int winograd : {2, 4})
        for (const ConvShape& shape :
             {ConvShape{1, 20, 31, 30, 27, 3}, ConvShape{1, 9, 32, 32, 12, 3},
              ConvShape{1, 12, 12, 4, 8, 3}, ConvShape{1, 8, 12, 12, 4, 3}}) {
            Conv2dCase c = Conv2dCase::normal(shape, 810);
            c.winograd = winograd;
            calls.push_back(c.call());
        }
    // One to four blocks of 8 outputs, rows that fill no tile.
    for (const std::uint32_t out : {5U, 13U, 24U, 29U, 72U})
        calls.push_back(linear_call({101, 19, out}, 820));
    return calls;
}

TEST(RegisterTiles, GiveTheSameBits) {
    const std::function<void(vk::DeviceInfo&)> kinds[] = {
        [](vk::DeviceInfo& cpu) {
            cpu.features.many_registers = cpu.features.large_code_cache = false;
        },
        [](vk::DeviceInfo& cpu) {
            cpu.features.many_registers = true, cpu.features.large_code_cache = false;
        },
        [](vk::DeviceInfo& cpu) {
            cpu.features.many_registers = cpu.features.large_code_cache = true;
        },
        [](vk::DeviceInfo& cpu) { cpu.features.packed_stores = !cpu.features.packed_stores; }};
    expect_same_bits(vk::Kernels::kCpu, kinds, product_calls());
}

TEST(RegisterTiles, GiveTheSameBitsOnGpusOfEachDriver) {
    const std::function<void(vk::DeviceInfo&)> kinds[] = {
        [](vk::DeviceInfo&) {},
        [](vk::DeviceInfo& gpu) { gpu.driver_id = VK_DRIVER_ID_NVIDIA_PROPRIETARY; },
        [](vk::DeviceInfo& gpu) { gpu.limits.shared_memory_bytes = 17 << 10; }};
    std::vector<OpCall> calls = product_calls();
    Conv2dCase direct = Conv2dCase::normal(ConvShape{2, 20, 9, 11, 44, 3}, 830);
    calls.push_back(direct.call());
    calls.push_back(attention_call({1, 20, 600}, 850));
    // Enough for tiles of 128, which 17 KiB do not hold.
    Conv2dCase large = Conv2dCase::normal(ConvShape{1, 68, 125, 127, 68, 3}, 860);
    large.winograd = 4;
    calls.push_back(large.call());
    calls.push_back(linear_call({33801, 5, 66}, 870));
    calls.push_back(attention_call({66, 4, 250}, 880));
    expect_same_bits(vk::Kernels::kGpu, kinds, calls);
}

/// Tiles of 128, of a gradient of a weight and of attention: smaller shapes do not fill a GPU.
TEST(RegisterTiles, LargeOnesOfGpusMatchFloat64) {
    for (const vk::Kernels kernels : kernels_to_test()) {
        if (kernels != vk::Kernels::kGpu) continue;
        expect_float64(*shared_context(kernels), linear_call({16897, 65, 66}, 890), "linear");
        expect_float64(*shared_context(kernels), attention_call({66, 4, 250}, 900), "attention");
    }
}

}  // namespace
}  // namespace splat::test
