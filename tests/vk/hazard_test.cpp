#include "vk/hazard.h"

#include <gtest/gtest.h>

#include <cstdio>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;

constexpr std::uint32_t kN = 1024;

/// A scene with every kind of hazard. `kinds` receives the reason of each inner barrier, in order.
CommandList record_scene(Context& context, std::vector<Buffer>& buffers,
                         std::vector<std::string>& kinds) {
    for (int i = 0; i < 4; ++i) buffers.push_back(device_buffer(context, kN));
    const BufferView a = buffers[0].range();
    const BufferView b = buffers[1].range();
    const BufferView c = buffers[2].range();
    const BufferView d = buffers[3].range();
    const double three_parts = flops_for(context, 2.5);

    Recorder r(context);
    EXPECT_OK(r.fill(a, 0));
    kinds.push_back("read after write, transfer to shader");
    EXPECT_OK(r.dispatch(scale(a, b, kN, 2)));
    kinds.push_back("read after write, shader to shader");
    EXPECT_OK(r.dispatch(scale(b, c, kN, 2)));
    kinds.push_back("write after read, shader to shader");
    EXPECT_OK(r.dispatch(scale(a, b, kN, 3)));
    kinds.push_back("write after write, shader to shader (the layer hides it)");
    EXPECT_OK(r.dispatch(scale(c, b, kN, 4)));
    kinds.push_back("write after read, shader to transfer");
    EXPECT_OK(r.fill(c, 0));
    kinds.push_back("write after write, transfer to shader, and read-modify-write");
    EXPECT_OK(r.dispatch(accumulate(a, c, kN)));
    kinds.push_back("read-modify-write twice (the layer hides it)");
    EXPECT_OK(r.dispatch(accumulate(a, c, kN)));
    kinds.push_back("read after read-modify-write");
    EXPECT_OK(r.copy(part(c, 0, 2048), part(d, 0, 2048)));
    kinds.push_back("write after write, transfer to transfer, overlapping in part");
    EXPECT_OK(r.fill(part(d, 2032, 64), 1));
    kinds.push_back("write after write, by a split dispatch");
    EXPECT_OK(r.dispatch(slow(d, {kN / 4, 4, 1}, 1, three_parts)));
    kinds.push_back("read after the write of a split dispatch");
    EXPECT_OK(r.copy(d, a));
    return need(r.finish());
}

TEST(Hazard, DetectsEachRemovedBarrier) {
    Context* context = shared_context();
    std::vector<Buffer> buffers;
    std::vector<std::string> kinds{"against the list before"};
    const CommandList list = record_scene(*context, buffers, kinds);
    const std::vector<Command>& commands = list.commands();
    kinds.push_back("to the host");
    ASSERT_OK(check_hazards(commands));

    std::size_t barriers = 0;
    std::size_t detected = 0;
    for (std::size_t i = 0; i < commands.size(); ++i) {
        const CommandKind kind = commands[i].kind;
        if (kind != CommandKind::kBarrier && kind != CommandKind::kToHost) continue;
        ASSERT_LT(barriers, kinds.size());
        std::vector<Command> without = commands;
        without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
        const Status status = check_hazards(without);
        EXPECT_FALSE(status.ok()) << "not detected: " << kinds[barriers];
        EXPECT_EQ(status.code(), Code::kInternal);
        detected += status.ok() ? 0U : 1U;
        ++barriers;
    }
    EXPECT_EQ(barriers, kinds.size());
    EXPECT_GE(barriers, 8U);
    std::printf("[ hazards  ] %zu of %zu removed barriers detected\n", detected, barriers);
}

TEST(Hazard, NamesBothCommandsAndRanges) {
    Context* context = shared_context();
    const Buffer a = device_buffer(*context, kN);
    const Buffer b = device_buffer(*context, kN);
    Recorder r(*context);
    r.omit_barriers = true;
    EXPECT_OK(r.fill(a.range(), 0));
    EXPECT_OK(r.dispatch(scale(a.range(), b.range(), kN, 2)));
    const CommandList list = need(r.finish());
    const Status status = check_hazards(list.commands());
    EXPECT_ERROR(status, Code::kInternal, "(fill)");
    EXPECT_ERROR(status, Code::kInternal, "(scale)");
    EXPECT_ERROR(status, Code::kInternal, "write and read");
}

TEST(Hazard, SeesThroughCommandsBetween) {
    Context* context = shared_context();
    std::vector<Buffer> buffers;
    for (int i = 0; i < 20; ++i) buffers.push_back(device_buffer(*context, 64));
    Recorder r(*context);
    r.omit_barriers = true;
    for (const Buffer& buffer : buffers) EXPECT_OK(r.fill(buffer.range(), 0));
    EXPECT_OK(r.fill(buffers[0].range(), 1));
    EXPECT_ERROR(check_hazards(r.finish().value().commands()), Code::kInternal, "write and write");
}

TEST(Hazard, EmptyListIsSafe) {
    EXPECT_OK(check_hazards({}));
}

TEST(Hazard, LayerReportsAMissingBarrierToo) {
    Context* context = shared_context();
    if (!validation_on()) GTEST_SKIP() << "validation is off";
    const Buffer a = device_buffer(*context, kN);
    const Buffer b = device_buffer(*context, kN);
    const Buffer c = device_buffer(*context, kN);
    Recorder r(*context);
    r.omit_barriers = true;
    EXPECT_OK(r.dispatch(scale(a.range(), b.range(), kN, 2)));
    EXPECT_OK(r.dispatch(scale(b.range(), c.range(), kN, 2)));
    CommandList list = need(r.finish());
    const ExpectedMessages bait;
    EXPECT_OK(context->run(list));
    EXPECT_GT(bait.count(), 0U)
        << "the layer does not know vkCmdDispatchBase: record vkCmdDispatch "
           "where the base is zero";
}

TEST(Hazard, LayerReportsAnAccessOutsideTheBinding) {
    Context* context = shared_context();
    if (!validation_on()) GTEST_SKIP() << "validation is off";
    const Buffer y = device_buffer(*context, 64);
    const auto run_with = [&](std::uint32_t index) {
        CommandList list = record(*context, {out_of_range(y.range(), index)});
        EXPECT_OK(context->run(list));
    };
    run_with(63);
    const ExpectedMessages bait;
    run_with(64);
    EXPECT_GT(bait.count(), 0U) << "GPU-assisted validation is off, or the layer cannot see this "
                                   "kind of dispatch";
}

}  // namespace
}  // namespace splat::vk
