// The CPU decides the register tiles and the form of stores. Whatever it decides, the order of sums
// is the same.
#include <gtest/gtest.h>

#include <functional>

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

TEST(RegisterTiles, GiveTheSameBits) {
    const std::function<void(vk::DeviceFeatures&)> kinds[] = {
        [](vk::DeviceFeatures& cpu) { cpu.many_registers = cpu.large_code_cache = false; },
        [](vk::DeviceFeatures& cpu) { cpu.many_registers = true, cpu.large_code_cache = false; },
        [](vk::DeviceFeatures& cpu) { cpu.many_registers = cpu.large_code_cache = true; },
        [](vk::DeviceFeatures& cpu) { cpu.packed_stores = !cpu.packed_stores; }};
    std::vector<std::shared_ptr<vk::Context>> contexts;
    for (const auto& kind : kinds) {
        vk::ContextDesc desc = context_desc(vk::Kernels::kCpu);
        desc.device.fake = [&kind](vk::DeviceInfo& info) { kind(info.features); };
        contexts.push_back(make_context(desc));
        ASSERT_NE(contexts.back(), nullptr);
    }
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

}  // namespace
}  // namespace splat::test
