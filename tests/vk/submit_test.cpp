#include "vk/submit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <mutex>
#include <optional>
#include <utility>

#include "core/fault.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;

constexpr std::uint32_t kScaled = 256;

/// Replacements in the function table; one test at a time uses them.
int g_timeouts = 0;  ///< calls that end in one, to come
constexpr int kStuck = 1 << 30;
int g_calls = 0;
PFN_vkWaitForFences g_wait = nullptr;
PFN_vkQueueSubmit g_submit = nullptr;

VKAPI_ATTR VkResult VKAPI_CALL wait_with_timeouts(VkDevice device, std::uint32_t count,
                                                  const VkFence* fences, VkBool32 all,
                                                  std::uint64_t timeout) {
    ++g_calls;
    if (g_timeouts > 0) {
        --g_timeouts;
        return VK_TIMEOUT;
    }
    return g_wait(device, count, fences, all, timeout);
}

VKAPI_ATTR VkResult VKAPI_CALL submit_loses_device(VkQueue, std::uint32_t, const VkSubmitInfo*,
                                                   VkFence) {
    return VK_ERROR_DEVICE_LOST;
}

VKAPI_ATTR VkResult VKAPI_CALL wait_loses_device(VkDevice device, std::uint32_t count,
                                                 const VkFence* fences, VkBool32 all,
                                                 std::uint64_t timeout) {
    g_wait(device, count, fences, all, timeout);
    return VK_ERROR_DEVICE_LOST;
}

CommandList record_scale(Context& context, const BufferView& x, const BufferView& y, float factor) {
    return record(context, {scale(x, y, kScaled, factor)});
}

/// The next `count` waits for the device time out.
void time_out(Context& context, int times) {
    VolkDeviceTable& vk = context.device().vk;
    g_wait = vk.vkWaitForFences;
    vk.vkWaitForFences = wait_with_timeouts;
    g_timeouts = times;
}

/// Submits of a context so far, and the one with which its call is cancelled.
struct Submits {
    int done = 0, cancelled_at = 0;
    Interrupt* interrupt = nullptr;
} g_submits;

Submits& count_submits(Context& context) {
    VolkDeviceTable& vk = context.device().vk;
    g_submits = {0, 0, &context.mutex.interrupt()};
    g_submit = vk.vkQueueSubmit;
    vk.vkQueueSubmit = [](VkQueue queue, std::uint32_t count, const VkSubmitInfo* info,
                          VkFence fence) {
        if (++g_submits.done == g_submits.cancelled_at) g_submits.interrupt->raise();
        return g_submit(queue, count, info, fence);
    };
    return g_submits;
}

/// A separate context with y = 3 x for x = 1, recorded but not run.
struct Scaling {
    std::shared_ptr<Context> context;
    Buffer x, y;
    CommandList list;
};

void expect_lost_for_ever(Context& context, CommandList& list, const BufferView& view) {
    std::vector<float> values(kScaled, -1);
    for (int round = 0; round < 2; ++round) {
        EXPECT_ERROR(context.run(list), Code::kDeviceLost, "lost");
        EXPECT_ERROR(context.write(view, values.data(), kScaled * 4), Code::kDeviceLost, "lost");
        EXPECT_ERROR(context.read(view, values.data(), kScaled * 4), Code::kDeviceLost, "lost");
        EXPECT_ERROR(context.fill(view, 1), Code::kDeviceLost, "lost");
        EXPECT_ERROR(context.memory().allocate(64, MemoryKind::kDevice, "x"), Code::kDeviceLost,
                     "lost");
        Recorder recorder(context);
        EXPECT_OK(recorder.fill(view, 1));
        EXPECT_ERROR(recorder.finish(), Code::kDeviceLost, "lost");
    }
    EXPECT_EQ(values, std::vector<float>(kScaled, -1));
}

class Submit : public testing::Test {
  protected:
    void SetUp() override {
        const auto context = make_context();
        Buffer x = upload(*context, std::vector<float>(kScaled, 1));
        Buffer y = device_buffer(*context, kScaled);
        CommandList list = record_scale(*context, x.range(), y.range(), 3);
        scaling_.emplace(Scaling{context, std::move(x), std::move(y), std::move(list)});
    }
    void expect_scaled() {
        EXPECT_EQ(download(*scaling_->context, scaling_->y.range(), kScaled),
                  std::vector<float>(kScaled, 3));
    }
    /// A device that one call of the driver reports as lost stays so, even if that call works again.
    template <typename Function>
    void expect_sticky_loss(Function VolkDeviceTable::*entry, Function loses, const char* name) {
        auto& [context, x, y, list] = *scaling_;
        const Function works = std::exchange(context->device().vk.*entry, loses);
        EXPECT_ERROR(context->run(list), Code::kDeviceLost, name);
        context->device().vk.*entry = works;
        expect_lost_for_ever(*context, list, y.range());
        expect_new_context_works();
    }

    void expect_new_context_works() {
        scaling_.reset();
        SetUp();
        EXPECT_OK(scaling_->context->run(scaling_->list));
        expect_scaled();
    }

    /// Several segments, whose numbers expect_slow_done() knows.
    CommandList record_slow() {
        Context& context = *scaling_->context;
        slow_ = device_buffer(context, 64);
        return record(context, {slow(slow_.range(), {64, 1, 1}, 1000, flops_for(context, 20))});
    }
    void expect_slow_done() {
        const auto words = download_words(*scaling_->context, slow_.range(), 64);
        for (std::uint32_t i = 0; i < 64; ++i) EXPECT_EQ(words[i] & 0xFFFFU, i);
    }

    std::optional<Scaling> scaling_;
    Buffer slow_;
};

TEST_F(Submit, TimeoutIsReportedAndRecoveredFrom) {
    auto& [context, x, y, list] = *scaling_;
    time_out(*context, kStuck);
    EXPECT_ERROR(context->run(list), Code::kTimeout, "SPLAT_TIMEOUT_SCALE");
    std::vector<float> values(kScaled, -1);
    EXPECT_ERROR(context->read(y.range(), values.data(), kScaled * 4), Code::kTimeout,
                 "did not finish");
    EXPECT_ERROR(context->settle(), Code::kTimeout, "Its last work: scale (test_scale); submit 1");
    EXPECT_EQ(values, std::vector<float>(kScaled, -1)) << "outputs untouched";
    g_timeouts = 0;
    g_calls = 0;
    EXPECT_OK(context->run(list));  // first waits for the run before
    EXPECT_EQ(g_calls, 2);
    expect_scaled();
}

/// In a process that was stopped, a wait ends at once although the device is not done.
TEST_F(Submit, OneTimeoutIsNotTheWholeWait) {
    auto& [context, x, y, list] = *scaling_;
    time_out(*context, 1);
    EXPECT_OK(context->run(list));
    EXPECT_EQ(g_timeouts, 0);
}

TEST_F(Submit, KeepsMemoryFreedDuringATimeout) {
    const auto& context = scaling_->context;
    const Buffer& x = scaling_->x;
    const Buffer keep = device_buffer(*context, kScaled);
    {
        Buffer y = device_buffer(*context, kScaled);
        const BufferView range = y.range();
        CommandList list = record_scale(*context, x.range(), y.range(), 3);
        time_out(*context, kStuck);
        EXPECT_ERROR(context->run(list), Code::kTimeout, "");
        g_timeouts = 0;
        y = Buffer();
        const Buffer fresh = device_buffer(*context, kScaled);
        EXPECT_FALSE(fresh.range().overlaps(range)) << "the device may still write there";
    }  // list and fresh are destroyed while the run counts as pending
    EXPECT_OK(context->fill(keep.range(), 5));
    EXPECT_EQ(download_words(*context, keep.range(), kScaled),
              std::vector<std::uint32_t>(kScaled, 5));
    const Buffer after = device_buffer(*context, kScaled);
    EXPECT_OK(context->fill(after.range(), 6));
}

TEST_F(Submit, LossAtSubmitIsSticky) {
    expect_sticky_loss(&VolkDeviceTable::vkQueueSubmit, submit_loses_device, "vkQueueSubmit");
}

TEST_F(Submit, LossAtWaitIsSticky) {
    g_wait = scaling_->context->device().vk.vkWaitForFences;
    expect_sticky_loss(&VolkDeviceTable::vkWaitForFences, wait_loses_device, "vkWaitForFences");
}

TEST_F(Submit, SplitListThatFailsHalfwayIsWaitedFor) {
    const auto& context = scaling_->context;
    CommandList list = record_slow();
    ASSERT_GT(list.submit_count(), 2U);
    static int submits;
    submits = 0;
    g_submit = context->device().vk.vkQueueSubmit;
    context->device().vk.vkQueueSubmit = [](VkQueue queue, std::uint32_t count,
                                            const VkSubmitInfo* info, VkFence fence) {
        if (++submits == 3) return VK_ERROR_OUT_OF_DEVICE_MEMORY;
        return g_submit(queue, count, info, fence);
    };
    EXPECT_ERROR(context->run(list), Code::kOutOfDeviceMemory, "vkQueueSubmit");
    EXPECT_OK(context->run(list));
    expect_slow_done();
}

TEST_F(Submit, CancelledListEndsBetweenItsSegments) {
    const auto& context = scaling_->context;
    CommandList list = record_slow();
    auto& [submits, cancelled_at, interrupt] = count_submits(*context);
    const auto run = [&](int cancel_at) {
        submits = 0;
        cancelled_at = cancel_at;
        const std::lock_guard lock(context->mutex);  // a call begins
        return context->run(list);
    };
    const auto segments = [&] { return static_cast<int>(list.submit_count()); };
    for (const int at : {1, 2, 3}) {
        list = record_slow();
        ASSERT_GT(segments(), 3);
        EXPECT_ERROR(run(at), Code::kCancelled, "splat_device_cancel");
        EXPECT_EQ(submits, std::max(at, 2)) << "one runs, one waits";
    }
    EXPECT_OK(run(0));
    EXPECT_EQ(submits, segments());
    expect_slow_done();
    const std::lock_guard lock(context->mutex);
    const Uncancelled whole(context->mutex);
    submits = 0;
    cancelled_at = 2;
    EXPECT_OK(context->run(list));
    EXPECT_EQ(submits, segments());
}

/// A list that was noted while Uncancelled is cancelled before it begins, and not in its middle.
TEST_F(Submit, NotedListIsWholeOnceItBegan) {
    const auto& context = scaling_->context;
    CommandList update = record_slow();
    CommandList before =
        record(*context, {slow(slow_.range(), {64, 1, 1}, 1000, flops_for(*context, 20))});
    auto& [submits, cancelled_at, interrupt] = count_submits(*context);
    Batch batch;
    const auto run = [&](int cancel_at) {
        submits = 0;
        cancelled_at = cancel_at;
        const std::lock_guard lock(context->mutex);  // a call begins
        BatchScope scope(*context, batch);
        EXPECT_OK(context->run(before));
        {
            const Uncancelled whole(context->mutex);
            EXPECT_OK(context->run(update));
        }
        return scope.finish();
    };
    EXPECT_OK(run(0));
    EXPECT_OK(run(submits - 1));
    const int all = submits;
    ASSERT_GT(all, 6);
    EXPECT_ERROR(run(2), Code::kCancelled, "splat_device_cancel");
    EXPECT_EQ(submits, 2);
    EXPECT_OK(run(all));
    EXPECT_EQ(submits, all);
    const std::lock_guard lock(context->mutex);  // the next call
    expect_slow_done();
}

/// What was submitted is waited for; segments that were not submitted do not run.
TEST_F(Submit, SplitListThatTimesOutIsRecoveredFrom) {
    const auto& context = scaling_->context;
    CommandList list = record_slow();
    ASSERT_GT(list.submit_count(), 3U);
    time_out(*context, kStuck);
    EXPECT_ERROR(context->run(list), Code::kTimeout, "SPLAT_TIMEOUT_SCALE");
    EXPECT_ERROR(context->run(list), Code::kTimeout, "did not finish");
    g_timeouts = 0;
    EXPECT_OK(context->run(list));
    expect_slow_done();
}

/// A loss names what was submitted and has not ended, of all lists that were joined.
TEST_F(Submit, LossNamesTheLastWork) {
    auto& [context, x, y, list] = *scaling_;
    CommandList add = record(*context, {accumulate(x.range(), y.range(), kScaled)});
    context->device().vk.vkQueueSubmit = submit_loses_device;
    Batch batch;
    BatchScope scope(*context, batch);
    EXPECT_OK(context->fill(y.range(), 0));
    EXPECT_OK(context->run(list));
    EXPECT_OK(context->run(add));
    const Status lost = scope.finish();
    EXPECT_ERROR(lost, Code::kDeviceLost,
                 "create it again. Its last work: fill to accumulate (test_accumulate");
    EXPECT_ERROR(lost, Code::kDeviceLost, "), most of it accumulate (test_accumulate");
    EXPECT_ERROR(lost, Code::kDeviceLost, "); submit 1 of 1");
#if defined(_WIN32)
    EXPECT_ERROR(lost, Code::kDeviceLost, "TdrDelay");
#endif
}

TEST_F(Submit, LossOfASegmentNamesThoseThatHaveNotEnded) {
    const auto& context = scaling_->context;
    CommandList list = record_slow();
    ASSERT_GT(list.submit_count(), 3U);
    static int waits;
    waits = 0;
    g_wait = context->device().vk.vkWaitForFences;
    context->device().vk.vkWaitForFences = [](VkDevice device, std::uint32_t count,
                                              const VkFence* fences, VkBool32 all,
                                              std::uint64_t timeout) {
        const VkResult result = g_wait(device, count, fences, all, timeout);
        return ++waits == 2 ? VK_ERROR_DEVICE_LOST : result;
    };
    EXPECT_ERROR(context->run(list), Code::kDeviceLost,
                 "Its last work: slow (test_slow) to slow (test_slow), most of it slow "
                 "(test_slow); submit 2 of ");
}

/// A slow device that works is not taken for one that hangs: the timeout is that of a segment.
TEST_F(Submit, EachSegmentHasTheWholeTimeout) {
    ContextDesc desc = context_desc();
    desc.timeout_ns = 2'000'000'000;  // four pieces of waiting
    const auto context = make_context(desc);
    const Buffer y = device_buffer(*context, 64);
    CommandList list = record(*context, {slow(y.range(), {64, 1, 1}, 1, flops_for(*context, 20))});
    ASSERT_GT(list.submit_count(), 4U);
    g_wait = context->device().vk.vkWaitForFences;
    g_calls = 0;
    context->device().vk.vkWaitForFences = [](VkDevice device, std::uint32_t count,
                                              const VkFence* fences, VkBool32 all,
                                              std::uint64_t timeout) {
        return ++g_calls % 2 == 1 ? VK_TIMEOUT : g_wait(device, count, fences, all, timeout);
    };
    EXPECT_OK(context->run(list));
    EXPECT_GT(g_calls, 2 * 4);
}

#if SPLAT_FAULT_POINTS
/// Allocate, compute, read back; through staging, so that every fault point of the Vulkan layer
/// lies on the way.
Status scenario(Context& context, std::vector<float>& result) {
    const std::vector<float> ones(kScaled, 1);
    SPLAT_ASSIGN(const Buffer x, context.memory().allocate(kScaled * 4, MemoryKind::kDevice, "x"));
    SPLAT_ASSIGN(const Buffer y, context.memory().allocate(kScaled * 4, MemoryKind::kDevice, "y"));
    SPLAT_TRY(context.write(x.range(), ones.data(), kScaled * 4));
    Recorder recorder(context);
    SPLAT_TRY(recorder.dispatch(scale(x.range(), y.range(), kScaled, 3)));
    SPLAT_ASSIGN(CommandList list, recorder.finish());
    SPLAT_TRY(context.run(list));
    return context.read(y.range(), result.data(), kScaled * 4);
}

TEST_F(Submit, EveryFaultPointFailsCleanlyAndRetries) {
    ContextDesc desc = context_desc();
    desc.memory.hide_host = true;
    std::vector<float> result(kScaled, -1);
    fault::arm(nullptr, ~std::uint64_t{0} - 1, 1);  // never fails: counts
    {
        const auto context = make_context(desc);
        ASSERT_OK(scenario(*context, result));
    }
    const std::uint64_t points = fault::disarm();
    EXPECT_GT(points, 15U);
    ASSERT_EQ(result, std::vector<float>(kScaled, 3));

    for (std::uint64_t n = 1; n <= points; ++n) {
        result.assign(kScaled, -1);
        fault::arm(nullptr, n, 1);
        auto opened = Context::create(desc);
        if (!opened.ok()) {
            EXPECT_GE(fault::disarm(), n);
            EXPECT_NE(opened.status().message(), "");
            continue;
        }
        const auto context = std::move(opened.value());
        const Status failed = scenario(*context, result);
        EXPECT_GE(fault::disarm(), n);
        EXPECT_FALSE(failed.ok()) << "point " << n << " of " << points;
        EXPECT_EQ(result, std::vector<float>(kScaled, -1)) << n;
        EXPECT_EQ(context->memory().use().live, 0U) << n;
        if (failed.code() == Code::kDeviceLost) continue;
        EXPECT_OK(scenario(*context, result)) << n;
        EXPECT_EQ(result, std::vector<float>(kScaled, 3)) << n;
    }
}
#endif

}  // namespace
}  // namespace splat::vk
