#include "vk/pipeline.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <thread>

#include "core/fault.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/log_capture.h"
#include "support/system.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

TEST(Pipeline, SpecialisationConstantsChangeResults) {
    Context* context = test::shared_context();
    const Buffer x = test::upload(*context, std::vector<float>(100, 1));
    const Buffer y = test::device_buffer(*context, 100);
    for (const float offset : {0.0F, 0.5F, -3.0F}) {
        CommandList list =
            test::record(*context, {test::scale(x.range(), y.range(), 100, 2, offset)});
        EXPECT_OK(context->run(list));
        EXPECT_EQ(test::download(*context, y.range(), 100), std::vector<float>(100, 2 + offset));
    }
}

TEST(Pipeline, WorkgroupSizeIsAConstant) {
    Context* context = test::shared_context();
    const Buffer x = test::upload(*context, std::vector<float>(256, 1));
    for (const std::uint32_t size : {1U, 8U, 64U, 128U}) {
        const Buffer y = test::upload(*context, std::vector<float>(256, 0));
        Dispatch dispatch = test::scale(x.range(), y.range(), 256, 2);
        dispatch.constants[0].value = size;
        dispatch.groups = {1, 1, 1};
        CommandList list = test::record(*context, {dispatch});
        EXPECT_OK(context->run(list));
        std::vector<float> expected(256, 0);
        std::fill_n(expected.begin(), size, 2.0F);
        EXPECT_EQ(test::download(*context, y.range(), 256), expected) << size;
    }
}

TEST(Pipeline, IsToldOnceWithItsConstants) {
    Pipelines& pipelines = test::shared_context()->pipelines();
    const test::LogCapture log(LogLevel::kDebug);
    const std::vector<SpecConstant> constants = {{params::kWorkgroupSizeId, 16},
                                                 {test::kTestOffsetId, 7}};
    for (int i = 0; i < 2; ++i) EXPECT_OK(pipelines.get("test_scale", constants));
    EXPECT_EQ(log.text(), format("pipeline test_scale 0=16 %u=7\n", test::kTestOffsetId));
}

TEST(Pipeline, IsMadeOncePerKey) {
    Context* context = test::shared_context();
    Pipelines& pipelines = context->pipelines();
    const Pipeline* first =
        pipelines.get("test_scale", {{params::kWorkgroupSizeId, 64}, {test::kTestOffsetId, 0}})
            .value();
    EXPECT_EQ(
        pipelines.get("test_scale", {{params::kWorkgroupSizeId, 64}, {test::kTestOffsetId, 0}})
            .value(),
        first);
    EXPECT_NE(
        pipelines.get("test_scale", {{params::kWorkgroupSizeId, 32}, {test::kTestOffsetId, 0}})
            .value(),
        first);
    EXPECT_NE(pipelines.get("test_accumulate", {{params::kWorkgroupSizeId, 64}}).value(), first);
}

TEST(Pipeline, FindsInfinityWithAndWithoutTheMode) {
    for (const bool mode : {false, true}) {
        ContextDesc desc = test::context_desc();
        desc.device.fake = [mode](DeviceInfo& info) { info.features.nan_mode = mode; };
        const auto context = test::make_context(desc);
        const Buffer x = test::upload(*context, std::vector<float>{0, 1, 3e38F, -1e37F});
        const Buffer y = test::device_buffer(*context, 4);
        CommandList list = test::record(*context, {test::finite(x.range(), y.range(), 4, 8)});
        EXPECT_OK(context->run(list));
        EXPECT_EQ(test::download(*context, y.range(), 4), (std::vector<float>{1, 1, 0, 1})) << mode;
    }
}

TEST(Pipeline, UnknownShaderIsAnError) {
    Context* context = test::shared_context();
    EXPECT_ERROR(context->pipelines().get("nothing", {}), Code::kInternal, "nothing");
}

#if SPLAT_FAULT_POINTS
TEST(Pipeline, FailureLeavesNothingBehind) {
    const auto context = test::make_context();
    fault::arm("vk.create_pipeline", 1, 1);
    const auto failed = context->pipelines().get("test_scale", {{params::kWorkgroupSizeId, 64}});
    EXPECT_EQ(fault::disarm(), 1U);
    ASSERT_FALSE(failed.ok());
    EXPECT_ERROR(failed, Code::kOutOfDeviceMemory, "vkCreateComputePipelines");
    const auto retried =
        need(context->pipelines().get("test_scale", {{params::kWorkgroupSizeId, 64}}));
    EXPECT_OK(context->pipelines().wait(*retried));
    EXPECT_NE(retried->job.pipeline, VK_NULL_HANDLE);
}
#endif

VKAPI_ATTR VkResult VKAPI_CALL compile_without_memory(VkDevice, VkPipelineCache, std::uint32_t,
                                                      const VkComputePipelineCreateInfo*,
                                                      const VkAllocationCallbacks*, VkPipeline*) {
    return VK_ERROR_OUT_OF_HOST_MEMORY;
}

VKAPI_ATTR VkResult VKAPI_CALL load_without_memory(VkDevice, const VkShaderModuleCreateInfo*,
                                                   const VkAllocationCallbacks*, VkShaderModule*) {
    return VK_ERROR_OUT_OF_DEVICE_MEMORY;
}

/// On threads of their own; or, as under validation, on the caller's.
class PipelineThreads : public testing::TestWithParam<bool> {
  protected:
    void SetUp() override {
        ContextDesc desc = test::context_desc();
        if (GetParam()) desc.device.validation = false;
        context_ = test::make_context(desc);
    }
    Pipeline* get(std::uint32_t size) {
        return context_->pipelines()
            .get("test_scale", {{params::kWorkgroupSizeId, size}, {test::kTestOffsetId, 0}})
            .value();
    }

    std::shared_ptr<Context> context_;
};
INSTANTIATE_TEST_SUITE_P(, PipelineThreads, testing::Bool(),
                         [](const auto& of) { return of.param ? "own" : "none"; });

TEST_P(PipelineThreads, WhatDoesNotCompileIsTriedAgain) {
    VolkDeviceTable& vk = context_->device().vk;
    const VolkDeviceTable good = vk;
    vk.vkCreateComputePipelines = compile_without_memory;
    const Buffer x = test::upload(*context_, std::vector<float>(100, 1));
    const Buffer y = test::device_buffer(*context_, 100);
    CommandList list = test::record(*context_, {test::scale(x.range(), y.range(), 100, 2, 0.5F)});
    for (int i = 0; i < 2; ++i)
        EXPECT_ERROR(context_->run(list), Code::kOutOfHostMemory, "vkCreateComputePipelines");
    vk.vkCreateShaderModule = load_without_memory;
    EXPECT_ERROR(context_->make_ready(list), Code::kOutOfDeviceMemory, "vkCreateShaderModule");
    vk = good;
    EXPECT_OK(context_->make_ready(list));
    EXPECT_OK(context_->run(list));
    EXPECT_EQ(test::download(*context_, y.range(), 100), std::vector<float>(100, 2.5F));
}

TEST_P(PipelineThreads, ManyCompileAtOnceAndMayBeGivenUp) {
    std::vector<Pipeline*> made;
    for (std::uint32_t size = 1; size <= 64; ++size) made.push_back(get(size));
    for (Pipeline* pipeline : made) {
        EXPECT_OK(context_->pipelines().wait(*pipeline));
        EXPECT_NE(pipeline->job.pipeline, VK_NULL_HANDLE);
    }
    for (std::uint32_t size = 65; size <= 128; ++size) get(size);  // nobody waits for these
}

/// A static object of a driver, there before any device is opened, which its compiler needs.
struct DriverObject {
    ~DriverObject() {
        gone = true;
        if (in_use) std::this_thread::sleep_for(std::chrono::milliseconds(300));
    }
    std::atomic<bool> gone = false, in_use = false;
} g_driver_object;

VKAPI_ATTR VkResult VKAPI_CALL compile_slowly(VkDevice, VkPipelineCache, std::uint32_t,
                                              const VkComputePipelineCreateInfo*,
                                              const VkAllocationCallbacks*, VkPipeline*) {
    g_driver_object.in_use = true;
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (g_driver_object.gone) std::_Exit(7);
    return VK_ERROR_OUT_OF_HOST_MEMORY;
}

TEST_P(PipelineThreads, ProcessMayEndMeanwhile) {
    GTEST_FLAG_SET(death_test_style,
                   "threadsafe");  // a new process, not a copy with one thread
    test::set_variable("LSAN_OPTIONS", "detect_leaks=0");  // it may end without freeing its memory
    const auto compile_and_exit = [&] {
        new std::shared_ptr<Context>(context_);  // never destroyed
        context_->device().vk.vkCreateComputePipelines = compile_slowly;
        for (std::uint32_t size = 1; size <= 64; ++size) get(size);
        std::this_thread::sleep_for(std::chrono::milliseconds(20));  // some have begun
        std::exit(0);
    };
    EXPECT_EXIT(compile_and_exit(), testing::ExitedWithCode(0), "");
}

}  // namespace
}  // namespace splat::vk
