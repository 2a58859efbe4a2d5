#include "vk/pace.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

using namespace test;
using Clock = std::chrono::steady_clock;

/// A device whose kernels take as long as the test says, by a clock of its own: the table's entries count the groups
/// that a command buffer runs, and the clock goes on when the host waits for them.
struct SimulatedDevice {
    VolkDeviceTable real;
    std::map<VkPipeline, double> group_seconds;
    double other_seconds = 0;  ///< a group of other pipelines
    std::map<VkCommandBuffer, std::map<VkPipeline, std::uint64_t>> groups;
    std::map<VkFence, double> ends;
    std::vector<double> segments;  ///< seconds of each submit
    VkPipeline bound = VK_NULL_HANDLE;
    double now = 0;
    double busy_until = 0;
    bool no_buffers = false;  ///< fails to allocate command buffers
};
SimulatedDevice* g_device = nullptr;

VKAPI_ATTR VkResult VKAPI_CALL begin(VkCommandBuffer to, const VkCommandBufferBeginInfo* info) {
    g_device->groups[to].clear();
    return g_device->real.vkBeginCommandBuffer(to, info);
}

VKAPI_ATTR void VKAPI_CALL bind(VkCommandBuffer to, VkPipelineBindPoint point, VkPipeline bound) {
    g_device->bound = bound;
    g_device->real.vkCmdBindPipeline(to, point, bound);
}

VKAPI_ATTR void VKAPI_CALL dispatch(VkCommandBuffer to, std::uint32_t x, std::uint32_t y,
                                    std::uint32_t z) {
    g_device->groups[to][g_device->bound] += std::uint64_t{x} * y * z;
    g_device->real.vkCmdDispatch(to, x, y, z);
}

VKAPI_ATTR void VKAPI_CALL dispatch_base(VkCommandBuffer to, std::uint32_t from_x,
                                         std::uint32_t from_y, std::uint32_t from_z,
                                         std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    g_device->groups[to][g_device->bound] += std::uint64_t{x} * y * z;
    g_device->real.vkCmdDispatchBase(to, from_x, from_y, from_z, x, y, z);
}

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* info,
                                      VkFence fence) {
    SimulatedDevice& device = *g_device;
    double seconds = 0;
    for (const auto& [pipeline, groups] : device.groups[*info->pCommandBuffers]) {
        const auto found = device.group_seconds.find(pipeline);
        seconds += static_cast<double>(groups) *
                   (found != device.group_seconds.end() ? found->second : device.other_seconds);
    }
    device.busy_until = std::max(device.now, device.busy_until) + seconds;
    device.ends[fence] = device.busy_until;
    device.segments.push_back(seconds);
    return device.real.vkQueueSubmit(queue, count, info, fence);
}

VKAPI_ATTR VkResult VKAPI_CALL wait(VkDevice device, std::uint32_t count, const VkFence* fences,
                                    VkBool32 all, std::uint64_t timeout) {
    g_device->now = std::max(g_device->now, g_device->ends[*fences]);
    return g_device->real.vkWaitForFences(device, count, fences, all, timeout);
}

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkCommandBufferAllocateInfo* info,
                                        VkCommandBuffer* buffers) {
    if (!g_device->no_buffers)
        return g_device->real.vkAllocateCommandBuffers(device, info, buffers);
    std::fill_n(buffers, info->commandBufferCount, nullptr);
    return VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

Clock::time_point simulated_now() {
    return Clock::time_point(
        std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(g_device->now)));
}

constexpr Groups kGroups{4096, 1, 1};
constexpr double kBudget = 0.1;

class PaceOfDevice : public testing::Test {
  protected:
    void SetUp() override { open(DeviceKind::kIntegrated); }

    void open(DeviceKind kind) {
        y_ = Buffer();
        ContextDesc desc = context_desc();
        desc.device.max_submit_ns = 100'000'000;
        desc.device.fake = [kind](DeviceInfo& info) { info.kind = kind; };
        context_ = make_context(desc);
        y_ = device_buffer(*context_, kGroups[0]);
        VolkDeviceTable& vk = context_->device().vk;
        device_ = {};
        device_.real = vk;
        g_device = &device_;
        vk.vkBeginCommandBuffer = begin;
        vk.vkCmdBindPipeline = bind;
        vk.vkCmdDispatch = dispatch;
        vk.vkCmdDispatchBase = dispatch_base;
        vk.vkQueueSubmit = submit;
        vk.vkWaitForFences = wait;
        vk.vkAllocateCommandBuffers = allocate;
        context_->device().pace.now = simulated_now;
    }

    /// Flops of so many seconds, by the rates before anything is measured.
    double flops(double seconds) {
        const vk::Device& device = context_->device();
        return seconds * 1e9 / estimated_seconds(device.info(), device.kernels(), {.flops = 1e9});
    }

    CommandList record_slow(double seconds) {
        return record(*context_, {slow(y_.range(), kGroups, 1, flops(seconds))});
    }

    /// Seconds of the segments of one run.
    std::vector<double> run(CommandList& list) {
        device_.segments.clear();
        EXPECT_OK(context_->run(list));
        EXPECT_EQ(device_.segments.size(), list.submit_count());
        const std::vector<double> segments = device_.segments;  // the download may have one, too
        const bool no_buffers = std::exchange(device_.no_buffers, false);
        const auto words = download_words(*context_, y_.range(), kGroups[0]);
        device_.no_buffers = no_buffers;
        for (std::uint32_t i = 0; i < kGroups[0]; ++i) EXPECT_EQ(words[i] & 0xFFFFU, i);
        return segments;
    }

    std::shared_ptr<Context> context_;
    Buffer y_;
    SimulatedDevice device_;
};

double longest(const std::vector<double>& seconds) {
    return *std::max_element(seconds.begin(), seconds.end());
}

double sum(const std::vector<double>& seconds) {
    return std::accumulate(seconds.begin(), seconds.end(), 0.0);
}

TEST_F(PaceOfDevice, NoSegmentIsLongWhereRatesAreWrong) {
    for (const double wrong : {30.0, 5.0, 1.0, 1 / 30.0}) {
        open(DeviceKind::kIntegrated);
        device_.other_seconds = wrong / kGroups[0];
        CommandList list = record_slow(1);
        for (int round = 0; round < 4; ++round) {
            const std::vector<double> segments = run(list);
            EXPECT_NEAR(sum(segments), wrong, 1e-6 * wrong);
            EXPECT_LE(longest(segments), 2 * kBudget) << wrong << ", run " << round;
            if (round == 0) {
                EXPECT_LE(segments[0], wrong * kBudget / 32 + 1e-9);
            }
        }
        // A kernel that is much faster is not trusted to stay so.
        const double planned = std::max(wrong, 0.25) / kBudget;
        EXPECT_LE(static_cast<double>(list.submit_count()), 2 * planned + 2) << wrong;
    }
}

TEST_F(PaceOfDevice, TimesArePutDownToTheirKernels) {
    const Buffer x = device_buffer(*context_, kGroups[0] * kGroupSize);
    const Buffer z = device_buffer(*context_, kGroups[0] * kGroupSize);
    Dispatch fast = scale(x.range(), z.range(), kGroups[0] * kGroupSize, 2);
    fast.work.flops = flops(1);
    const Dispatch slow_one = slow(y_.range(), kGroups, 1, flops(0.05));
    CommandList list = record(*context_, {fast, slow_one, fast, slow_one, fast});
    EXPECT_OK(context_->make_ready(list));
    VkPipeline slow_pipeline = VK_NULL_HANDLE;
    for (const Command& command : list.commands())
        if (command.op == "slow") slow_pipeline = command.pipeline->job.pipeline;
    device_.other_seconds = 0.5 / kGroups[0];
    device_.group_seconds[slow_pipeline] = 30 * 0.05 / kGroups[0];
    for (int round = 0; round < 6; ++round) EXPECT_LE(longest(run(list)), 2 * kBudget) << round;
    Pace& pace = context_->device().pace;
    EXPECT_GT(pace.of("test_slow").factor, 15);
    EXPECT_LT(pace.of("test_scale").factor, 2);
    CommandList alone = record_slow(2);
    device_.group_seconds[slow_pipeline] = 30 * 2.0 / kGroups[0];
    EXPECT_LE(longest(run(alone)), 2 * kBudget) << "what is known holds for other lists";
}

/// Rasterizers have such runs: the first frame, if the room for pairs is too small, and views of nothing.
TEST_F(PaceOfDevice, RunsWithLittleToDoTellNothingOfABound) {
    Recorder recorder(*context_);
    recorder.bounds = true;
    EXPECT_OK(recorder.dispatch(slow(y_.range(), kGroups, 1, flops(1))));
    CommandList list = need(recorder.finish());
    for (int round = 0; round < 8; ++round) run(list);
    device_.other_seconds = 30.0 / kGroups[0];
    for (int round = 0; round < 3; ++round) EXPECT_LE(longest(run(list)), 2 * kBudget) << round;
    device_.other_seconds = 0;
    for (int round = 0; round < 8; ++round) run(list);
    device_.other_seconds = 30.0 / kGroups[0];
    EXPECT_LE(longest(run(list)), 2 * kBudget);
}

TEST_F(PaceOfDevice, ListsGoOnAsTheyAreCutWithoutMemory) {
    device_.other_seconds = 30.0 / kGroups[0];
    CommandList list = record_slow(1);
    const std::size_t segments = list.submit_count();
    device_.no_buffers = true;
    EXPECT_EQ(run(list).size(), segments);
    EXPECT_EQ(run(list).size(), segments);
    device_.no_buffers = false;
    EXPECT_GT(run(list).size(), segments);
}

TEST_F(PaceOfDevice, FastCpuDevicesKeepTheirSegments) {
    open(DeviceKind::kCpu);
    device_.other_seconds = 0.1 * 3 / kGroups[0];
    CommandList list = record_slow(3);
    const std::size_t segments = list.submit_count();
    EXPECT_GE(segments, 30U);
    for (int round = 0; round < 5; ++round) EXPECT_EQ(run(list).size(), segments);
    device_.other_seconds = 4 * 3.0 / kGroups[0];
    run(list);
    EXPECT_LE(longest(run(list)), 2 * kBudget);
}

TEST(Pace, RisesAtOnceAndFallsSlowly) {
    Pace pace(true, kBudget);
    KernelPace& kernel = pace.of("a");
    EXPECT_EQ(&kernel, &pace.of("a"));
    EXPECT_EQ(pace.planned(kernel, 0), 32) << "cautious of a kernel that was never measured";
    EXPECT_EQ(pace.planned(kernel, 2), 8);
    EXPECT_EQ(pace.planned(kernel, 40), 1);
    const auto learn = [&](double estimated, double seconds) {
        kernel.seconds = estimated;
        return pace.learn(kernel, seconds, seconds / (estimated * kernel.factor));
    };
    EXPECT_TRUE(learn(0.01, 0.06));
    EXPECT_DOUBLE_EQ(kernel.factor, 6);
    EXPECT_DOUBLE_EQ(pace.planned(kernel, 0), 6);
    EXPECT_EQ(pace.changes(), 1U);
    EXPECT_FALSE(learn(0.01, 0.02));
    EXPECT_DOUBLE_EQ(kernel.factor, 4);
    EXPECT_FALSE(learn(0.0001, 0.002)) << "the time of a short submit says little";
    EXPECT_DOUBLE_EQ(kernel.factor, 4);
    EXPECT_FALSE(pace.learn(kernel, 1, 9)) << "learnt from already";
    for (int i = 0; i < 20; ++i) learn(0.01, 0);
    EXPECT_DOUBLE_EQ(kernel.factor, 0.25) << "it may have had nothing to do";
    const std::uint64_t changes = pace.changes();
    learn(0.01, 0);
    EXPECT_EQ(pace.changes(), changes);
}

TEST(Pace, SubmitsAreLongerOnCpuDevices) {
    EXPECT_EQ(Pace(true).submit_seconds(), 0.1);
    EXPECT_EQ(Pace(false).submit_seconds(), 0.25);
    EXPECT_EQ(Pace(false, 0.02).submit_seconds(), 0.02);
    EXPECT_EQ(Pace(true, 1e-9).submit_seconds(), 1e-3);
    const KernelPace unknown;
    EXPECT_EQ(Pace(false).planned(unknown, 0), 1) << "no watchdog";
}

}  // namespace
}  // namespace splat::vk
