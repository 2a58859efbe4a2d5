#include "vk/memory.h"

#include <gtest/gtest.h>

#include "core/fault.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"

namespace splat::vk {
namespace {

using namespace test;

constexpr std::uint64_t kMiB = std::uint64_t{1} << 20;

/// A context with exact figures: no guards, small blocks.
std::shared_ptr<Context> plain_context(std::uint64_t budget, std::uint64_t block) {
    ContextDesc desc = context_desc();
    desc.memory.guard = false;
    desc.memory.budget_bytes = budget;
    desc.memory.block_bytes = block;
    return make_context(desc);
}

Result<Buffer> take(Context& context, std::uint64_t bytes) {
    return context.memory().allocate(bytes, MemoryKind::kDevice, "activations");
}

TEST(Memory, EnforcesItsBudgetExactly) {
    const auto context = plain_context(4 * kMiB, kMiB);
    std::vector<Buffer> held;
    for (int i = 0; i < 4; ++i) {
        auto buffer = take(*context, kMiB);
        ASSERT_TRUE(buffer.ok()) << i << ": " << buffer.status().message();
        held.push_back(std::move(buffer.value()));
    }
    EXPECT_EQ(context->memory().use().used, 4 * kMiB);
    const auto refused = take(*context, 16);
    ASSERT_FALSE(refused.ok());
    EXPECT_ERROR(refused, Code::kOutOfDeviceMemory, "activations");
    EXPECT_HAS(refused.status().message(), "4194304");
    held.pop_back();
    EXPECT_TRUE(take(*context, kMiB).ok());
}

TEST(Memory, SharesBlocksAndUsesWhatIsLeftOfTheBudget) {
    const auto context = plain_context(kMiB + kMiB / 2, kMiB);
    const auto first = take(*context, 1000);
    const auto second = take(*context, 1000);
    EXPECT_EQ(context->memory().use().allocations, 1U);
    EXPECT_EQ(context->memory().use().used, kMiB);
    EXPECT_NE(first.value().range().offset, second.value().range().offset);
    EXPECT_FALSE(first.value().range().overlaps(second.value().range()));
    const auto third = take(*context, kMiB / 2 + kMiB / 4);  // fits the block's rest
    EXPECT_TRUE(third.ok());
    const auto fourth = take(*context, kMiB / 2);  // fits no whole block: gets one of its size
    EXPECT_TRUE(fourth.ok());
    EXPECT_EQ(context->memory().use().used, kMiB + kMiB / 2);
}

TEST(Memory, CoalescesAndReturnsEmptyBlocks) {
    const auto context = plain_context(0, kMiB);
    for (const auto& order :
         {std::vector<std::size_t>{0, 1, 2, 3}, {3, 2, 1, 0}, {1, 3, 0, 2}, {2, 0, 3, 1}}) {
        std::vector<Buffer> quarters(4);
        for (Buffer& quarter : quarters) quarter = need(take(*context, kMiB / 4));
        EXPECT_EQ(context->memory().use().live, kMiB);
        for (std::size_t n = 0; n + 1 < order.size(); ++n) quarters[order[n]] = Buffer();
        EXPECT_EQ(context->memory().use().allocations, 1U);
        EXPECT_EQ(context->memory().use().live, kMiB / 4);
        quarters.clear();
        EXPECT_EQ(context->memory().use().allocations, 0U);
        EXPECT_EQ(context->memory().use().used, 0U);
        EXPECT_EQ(context->memory().use().live, 0U);
    }
    EXPECT_EQ(context->memory().use().peak, kMiB);
}

TEST(Memory, ReusesHolesFirstFit) {
    const auto context = plain_context(0, kMiB);
    std::vector<Buffer> parts(4);
    for (Buffer& buffer : parts) buffer = need(take(*context, 4096));
    const std::uint64_t hole = parts[1].range().offset;
    parts[1] = Buffer();
    const Buffer small = need(take(*context, 1024));
    EXPECT_EQ(small.range().offset, hole);
    const Buffer large = need(take(*context, 4096));
    EXPECT_GT(large.range().offset, parts[3].range().offset);
    EXPECT_EQ(context->memory().use().allocations, 1U);
}

TEST(Memory, RandomAllocationsNeverOverlap) {
    const auto context = plain_context(0, kMiB);
    Rng rng(11);
    std::vector<Buffer> held;
    std::uint64_t peak = 0;
    for (int step = 0; step < 2000; ++step) {
        if (held.size() > 40 || (!held.empty() && rng.below(3) == 0)) {
            std::swap(held[rng.below(held.size())], held.back());
            held.pop_back();
        } else {
            const std::uint64_t bytes = 1 + rng.below(100000);
            held.push_back(need(take(*context, bytes)));
            const BufferView& fresh = held.back().range();
            EXPECT_GE(fresh.bytes, bytes);
            EXPECT_EQ(fresh.offset % 64, 0U);
            for (std::size_t i = 0; i + 1 < held.size(); ++i)
                ASSERT_FALSE(fresh.overlaps(held[i].range())) << step;
        }
        const MemoryUse use = context->memory().use();
        std::uint64_t live = 0;
        for (const Buffer& buffer : held) live += buffer.bytes();
        ASSERT_GE(use.live, live);
        ASSERT_GE(use.used, use.live);
        peak = std::max(peak, use.used);
        ASSERT_EQ(use.peak, peak);
    }
    held.clear();
    EXPECT_EQ(context->memory().use().used, 0U);
}

TEST(Memory, RefusesMoreThanTheDeviceAllocatesAtOnce) {
    ContextDesc desc = context_desc();
    desc.device.fake = [](DeviceInfo& info) { info.limits.max_allocation_bytes = kMiB; };
    const auto context = make_context(desc);
    const auto refused = take(*context, kMiB + 1);
    ASSERT_FALSE(refused.ok());
    EXPECT_ERROR(refused, Code::kUnsupported, "activations");
    const auto overflow = take(*context, ~std::uint64_t{0} - 4096);
    ASSERT_FALSE(overflow.ok());
    EXPECT_ERROR(overflow, Code::kUnsupported, "activations");
    EXPECT_EQ(context->memory().use().allocations, 0U);
}

TEST(Memory, DetectsOverwrittenGuards) {
    const auto context = make_context();
    const Buffer buffer = device_buffer(*context, 100);
    std::byte* host = Memory::host(buffer.range());
    if (host == nullptr) GTEST_SKIP() << "device memory is not mapped here, so it has no guards";
    EXPECT_OK(context->memory().check_guards());
    for (const std::ptrdiff_t at :
         {std::ptrdiff_t{-1}, std::ptrdiff_t{-64}, std::ptrdiff_t{400}, std::ptrdiff_t{463}}) {
        const std::byte before = host[at];
        host[at] = ~before;
        EXPECT_ERROR(context->memory().check_guards(), Code::kInternal, "guard") << at;
        host[at] = before;
        EXPECT_OK(context->memory().check_guards());
    }
}

TEST(Memory, DetectsGuardsOverwrittenBeforeTheBufferWasFreed) {
    ContextDesc desc = context_desc();
    auto opened = need(Context::create(desc));
    Context& context = *opened;
    {
        const Buffer buffer = device_buffer(context, 100);
        std::byte* host = Memory::host(buffer.range());
        if (host == nullptr) GTEST_SKIP() << "device memory is not mapped here";
        host[400] = ~host[400];
    }
    EXPECT_ERROR(context.memory().check_guards(), Code::kInternal, "guard");
}

TEST(Memory, PoisonsFreshAllocations) {
    for (const std::uint32_t pattern : kPoisonPatterns) {
        ContextDesc desc = context_desc();
        desc.memory.poison = pattern;
        const auto context = make_context(desc);
        for (int round = 0; round < 2; ++round) {  // fresh memory and memory used before
            const Buffer buffer = device_buffer(*context, 1000);
            if (Memory::host(buffer.range()) == nullptr) GTEST_SKIP() << "not mapped";
            EXPECT_EQ(download_words(*context, buffer.range(), 1000),
                      std::vector<std::uint32_t>(1000, pattern));
            EXPECT_OK(context->fill(buffer.range(), 0x12345678U));
        }
    }
}

#if SPLAT_FAULT_POINTS
TEST(Memory, SurvivesFailuresOfTheDriver) {
    const auto context = plain_context(0, kMiB);
    for (const char* point : {"vk.create_buffer", "vk.allocate_memory", "vk.map_memory"}) {
        fault::arm(point, 1, 1);
        auto failed = take(*context, 1000);
        const std::uint64_t reached = fault::disarm();
        if (failed.ok() && Memory::host(failed.value().range()) == nullptr) continue;  // not mapped
        EXPECT_GE(reached, 1U) << point << " was not reached";
        ASSERT_FALSE(failed.ok()) << point;
        EXPECT_ERROR(failed, Code::kOutOfDeviceMemory, "vk");
        EXPECT_EQ(context->memory().use().allocations, 0U) << point;
        EXPECT_EQ(context->memory().use().used, 0U) << point;
        EXPECT_EQ(context->memory().use().live, 0U) << point;
        const auto retried = take(*context, 1000);
        EXPECT_TRUE(retried.ok()) << point;
    }
    EXPECT_EQ(context->memory().use().used, 0U);
}  // a leak would be reported by the validation layer when the device closes
#endif

}  // namespace
}  // namespace splat::vk
