#include <gtest/gtest.h>

#include <numeric>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

/// A device whose memory the host cannot see and whose staging memory is not coherent.
std::shared_ptr<Context> discrete_context(bool hide_host = true) {
    ContextDesc desc = test::context_desc();
    desc.memory.hide_host = hide_host;
    return test::make_context(desc);
}

std::vector<std::uint32_t> ramp(std::size_t count, std::uint32_t from) {
    std::vector<std::uint32_t> values(count);
    std::iota(values.begin(), values.end(), from);
    return values;
}

TEST(Staging, DeviceMemoryIsNotMapped) {
    const auto context = discrete_context();
    const Buffer buffer = test::device_buffer(*context, 100);
    EXPECT_EQ(Memory::host(buffer.range()), nullptr);
}

TEST(Staging, RoundTripsAllSizes) {
    const auto context = discrete_context();
    constexpr std::size_t kPiece = 8U << 18;  // elements of one staged piece
    for (const std::size_t count :
         {std::size_t{1}, std::size_t{3}, std::size_t{4}, std::size_t{5}, std::size_t{1000},
          kPiece - 1, kPiece, kPiece + 1, 2 * kPiece + 7}) {
        const std::vector<std::uint32_t> values = ramp(count, 17);
        const Buffer buffer = test::upload(*context, values);
        EXPECT_EQ(test::download_words(*context, buffer.range(), count), values) << count;
    }
    EXPECT_EQ(context->memory().use().used, 0U) << "staging memory does not count";
}

TEST(Staging, OneBufferServesAllTransfers) {
    const auto context = discrete_context();
    const Buffer buffer = test::upload(*context, ramp(20000, 1));
    std::uint64_t made = 0;
    const PFN_vkAllocateMemory allocate = context->device().vk.vkAllocateMemory;
    const PFN_vkCreateCommandPool pool = context->device().vk.vkCreateCommandPool;
    static std::uint64_t* count = nullptr;
    static PFN_vkAllocateMemory real_allocate = nullptr;
    static PFN_vkCreateCommandPool real_pool = nullptr;
    count = &made;
    real_allocate = allocate;
    real_pool = pool;
    context->device().vk.vkAllocateMemory = [](auto... a) { return ++*count, real_allocate(a...); };
    context->device().vk.vkCreateCommandPool = [](auto... a) { return ++*count, real_pool(a...); };
    for (std::uint32_t i = 0; i < 5; ++i) {
        const std::vector<std::uint32_t> values = ramp(20000, i);
        ASSERT_OK(context->write(buffer.range(), values.data(), 80000));
        EXPECT_EQ(test::download_words(*context, buffer.range(), 20000), values);
    }
    EXPECT_OK(context->write(buffer.range(), nullptr, 0));
    EXPECT_EQ(made, 0U) << "allocations and command pools";
}

TEST(Staging, WritesNothingBeyondItsBytes) {
    for (const bool hide_host : {false, true}) {
        const auto context = discrete_context(hide_host);
        const Buffer buffer = test::upload(*context, ramp(12, 0));
        const std::uint32_t fresh[5] = {100, 101, 102, 103, 104};
        EXPECT_OK(context->write(buffer.range(), fresh, sizeof fresh));
        const std::vector<std::uint32_t> expected{100, 101, 102, 103, 104, 5, 6, 7, 8, 9, 10, 11};
        EXPECT_EQ(test::download_words(*context, buffer.range(), 12), expected) << hide_host;
    }
}

TEST(Staging, ComputesAsOnMappedMemory) {
    const std::vector<float> x = test::normal_fill(1000, 3);
    std::vector<std::vector<float>> results;
    for (const bool hide_host : {false, true}) {
        const auto context = discrete_context(hide_host);
        const Buffer in = test::upload(*context, x);
        const Buffer out = test::device_buffer(*context, 1000);
        CommandList list =
            test::record(*context, {test::scale(in.range(), out.range(), 1000, 0.1F)});
        EXPECT_OK(context->run(list));
        results.push_back(test::download(*context, out.range(), 1000));
    }
    EXPECT_EQ(results[0], results[1]);
}

/// Flushes and invalidations of the calls so far, counted through the function table.
struct Traffic {
    PFN_vkFlushMappedMemoryRanges flush = nullptr;
    PFN_vkInvalidateMappedMemoryRanges invalidate = nullptr;
    int flushes = 0;
    int invalidations = 0;
};
Traffic g_traffic;

VKAPI_ATTR VkResult VKAPI_CALL count_flush(VkDevice device, std::uint32_t count,
                                           const VkMappedMemoryRange* ranges) {
    ++g_traffic.flushes;
    return g_traffic.flush(device, count, ranges);
}

VKAPI_ATTR VkResult VKAPI_CALL count_invalidate(VkDevice device, std::uint32_t count,
                                                const VkMappedMemoryRange* ranges) {
    ++g_traffic.invalidations;
    return g_traffic.invalidate(device, count, ranges);
}

TEST(Staging, FlushesAndInvalidatesWhatIsNotCoherent) {
    const auto context = discrete_context();
    VolkDeviceTable& vk = context->device().vk;
    g_traffic = {vk.vkFlushMappedMemoryRanges, vk.vkInvalidateMappedMemoryRanges, 0, 0};
    vk.vkFlushMappedMemoryRanges = count_flush;
    vk.vkInvalidateMappedMemoryRanges = count_invalidate;
    const Buffer buffer = test::upload(*context, ramp(10, 1));
    EXPECT_EQ(g_traffic.flushes, 1);
    EXPECT_EQ(g_traffic.invalidations, 0);
    EXPECT_EQ(test::download_words(*context, buffer.range(), 10), ramp(10, 1));
    EXPECT_EQ(g_traffic.invalidations, 1);
}

}  // namespace
}  // namespace splat::vk
