#include "vk/device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/environment.h"
#include "core/fault.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/gpu_env.h"
#include "support/system.h"
#include "test_shaders.h"

namespace splat::vk {
namespace {

/// Opens devices without SPLAT_KERNELS, whatever the run was started with.
class Device : public testing::Test {
  protected:
    void SetUp() override {
        kernels_ = environment("SPLAT_KERNELS");
        test::unset_variable("SPLAT_KERNELS");
        instance_ = Instance::get(test::validation_on()).value();
        infos_ = describe_devices(*instance_).value();
        ASSERT_FALSE(infos_.empty());
    }
    void TearDown() override {
        if (kernels_) test::set_variable("SPLAT_KERNELS", *kernels_);
    }

    static DeviceDesc desc() { return test::context_desc().device; }
    static Status open(const DeviceDesc& desc) { return vk::Device::create(desc).status(); }

    std::optional<std::string> kernels_;
    std::shared_ptr<Instance> instance_;
    std::vector<DeviceInfo> infos_;
};

TEST_F(Device, DescribesEveryDevice) {
    for (std::uint32_t i = 0; i < infos_.size(); ++i) {
        const DeviceInfo& info = infos_[i];
        EXPECT_EQ(info.index, i);
        EXPECT_FALSE(info.name.empty());
        EXPECT_STRNE(device_kind_name(info.kind), "unknown");
        if (!info.usable()) continue;
        EXPECT_GE(info.limits.max_storage_buffer_bytes, 1U << 27);  // the least Vulkan 1.2 allows
        EXPECT_GE(info.limits.max_allocation_bytes, info.limits.max_storage_buffer_bytes);
        EXPECT_GE(info.limits.max_buffer_bytes, info.limits.max_allocation_bytes);
        EXPECT_GE(info.limits.max_texel_elements, 65536U);
        EXPECT_GE(info.limits.max_group_invocations, 128U);
        EXPECT_GE(info.limits.push_constant_bytes, 128U);
        EXPECT_GE(info.limits.heap_bytes, 1U << 20);
        EXPECT_EQ(info.limits.offset_alignment % 16, 0U);
        EXPECT_GE(info.limits.least_lanes, 1U);
        EXPECT_GE(info.limits.subgroup_size, info.limits.least_lanes);
        EXPECT_GE(info.limits.most_lanes, info.limits.subgroup_size);
    }
}

TEST_F(Device, OpensTheBestByDefault) {
    const auto device = need(vk::Device::create(desc()));
    for (const DeviceInfo& info : infos_)
        if (info.usable() && info.passed_over.empty()) {
            EXPECT_GE(device->info().kind, info.kind);
        }
}

TEST_F(Device, OpensByIndexUuidAndKind) {
    for (const DeviceInfo& info : infos_) {
        if (!info.usable()) continue;
        DeviceDesc wish = desc();
        wish.select = DeviceSelect::kByIndex;
        wish.index = info.index;
        EXPECT_EQ(vk::Device::create(wish).value()->info().index, info.index);
        wish = desc();
        wish.select = DeviceSelect::kByUuid;
        wish.uuid = info.uuid;
        EXPECT_EQ(vk::Device::create(wish).value()->info().uuid, info.uuid);
        wish = desc();
        wish.select = DeviceSelect::kByKind;
        wish.kind = info.kind;
        EXPECT_EQ(vk::Device::create(wish).value()->info().kind, info.kind);
    }
}

TEST_F(Device, AbsentDeviceIsAnErrorThatListsWhatThereIs) {
    DeviceDesc wish = desc();
    wish.select = DeviceSelect::kByIndex;
    wish.index = 99;
    EXPECT_ERROR(open(wish), Code::kNoDevice, "with index 99");
    EXPECT_ERROR(open(wish), Code::kNoDevice, infos_[0].name);
    wish = desc();
    wish.select = DeviceSelect::kByUuid;
    wish.uuid.fill(0xEE);
    EXPECT_ERROR(open(wish), Code::kNoDevice, "eeeeeeee");
    wish = desc();
    wish.select = DeviceSelect::kByKind;
    for (const DeviceKind kind :
         {DeviceKind::kOther, DeviceKind::kVirtual, DeviceKind::kDiscrete}) {
        wish.kind = kind;
        const bool there = std::any_of(infos_.begin(), infos_.end(),
                                       [&](const DeviceInfo& info) { return info.kind == kind; });
        if (!there) {
            EXPECT_ERROR(open(wish), Code::kNoDevice, device_kind_name(kind));
        }
    }
}

TEST_F(Device, EnvironmentForcesKernels) {
    for (const Kernels kernels : {Kernels::kPlain, Kernels::kCpu, Kernels::kGpu}) {
        if (kernels != Kernels::kPlain && infos_[0].kernels[0] == Kernels::kPlain) continue;
        test::set_variable("SPLAT_KERNELS", kernels_name(kernels));
        EXPECT_EQ(vk::Device::create(desc()).value()->kernels(), kernels);
    }
    test::set_variable("SPLAT_KERNELS", "auto");
    EXPECT_OK(open(desc()));
    test::set_variable("SPLAT_KERNELS", "fastest");
    EXPECT_ERROR(open(desc()), Code::kInvalidArgument, "'fastest'");
    test::unset_variable("SPLAT_KERNELS");
}

TEST_F(Device, EnvironmentForcesLevels) {
    const auto before = environment("SPLAT_LEVELS");
    for (const char* text : {"0", "1"}) {
        test::set_variable("SPLAT_LEVELS", text);
        EXPECT_EQ(vk::Device::create(desc()).value()->info().features.levels, *text == '1');
    }
    test::set_variable("SPLAT_LEVELS", "off");
    EXPECT_ERROR(open(desc()), Code::kInvalidArgument, "SPLAT_LEVELS is 'off', expected 0 or 1");
    test::unset_variable("SPLAT_LEVELS");
    if (before) test::set_variable("SPLAT_LEVELS", *before);
}

TEST_F(Device, KernelsFollowSubgroups) {
    DeviceDesc narrow = desc();
    narrow.fake = [](DeviceInfo& info) { info.limits.subgroup_size = 4; };
    EXPECT_EQ(vk::Device::create(narrow).value()->kernels(), Kernels::kPlain);
    narrow.kernels = Kernels::kGpu;
    EXPECT_ERROR(open(narrow), Code::kUnsupported, "subgroups of 4 lanes");
    DeviceDesc silent = desc();
    silent.fake = [](DeviceInfo& info) { info.features.subgroup_shuffle = false; };
    EXPECT_EQ(vk::Device::create(silent).value()->kernels(), Kernels::kPlain);
    silent.kernels = Kernels::kCpu;
    EXPECT_ERROR(open(silent), Code::kUnsupported, "shuffle");
}

TEST_F(Device, FastKernelsNeedSharedMemoryAndWorkgroups) {
    DeviceDesc small = desc();
    small.fake = [](DeviceInfo& info) { info.limits.shared_memory_bytes = 16384; };
    EXPECT_EQ(vk::Device::create(small).value()->kernels(), Kernels::kPlain);
    small.kernels = Kernels::kGpu;
    EXPECT_ERROR(open(small), Code::kUnsupported, "16384 bytes of shared memory");
    DeviceDesc narrow = desc();
    narrow.fake = [](DeviceInfo& info) { info.limits.max_group_invocations = 128; };
    EXPECT_EQ(vk::Device::create(narrow).value()->kernels(), Kernels::kPlain);
}

/// The families of a GPU's kernels differ in what they need.
TEST_F(Device, GpusRunWhatTheyCanOfEachFamily) {
    const auto run = [&](const std::function<void(DeviceInfo&)>& lower) {
        DeviceDesc gpu = desc();
        gpu.fake = [&](DeviceInfo& info) {
            info.kind = DeviceKind::kDiscrete;
            info.features.subgroup_shuffle = info.features.subgroup_ballot = true;
            info.features.subgroup_arithmetic = true;
            info.limits.subgroup_size = info.limits.least_lanes = 16;
            info.limits.shared_memory_bytes = 16384;
            info.limits.max_group_invocations = 256;
            lower(info);
        };
        return kernels_text(need(vk::Device::create(gpu))->all_kernels());
    };
    EXPECT_EQ(run([](DeviceInfo&) {}), "gpu");
    EXPECT_EQ(run([](DeviceInfo& info) { info.features.subgroup_shuffle = false; }),
              "network plain, sort gpu, blend gpu");
    EXPECT_EQ(run([](DeviceInfo& info) { info.features.subgroup_ballot = false; }),
              "network gpu, sort plain, blend gpu");
    EXPECT_EQ(run([](DeviceInfo& info) { info.features.subgroup_arithmetic = false; }), "gpu");
    EXPECT_EQ(run([](DeviceInfo& info) { info.limits.subgroup_size = 4; }),
              "network plain, sort plain, blend gpu");
    EXPECT_EQ(run([](DeviceInfo& info) { info.limits.least_lanes = 8; }),
              "network gpu, sort plain, blend gpu")
        << "counters of 16 subgroups take 17,408 bytes";
    EXPECT_EQ(run([](DeviceInfo& info) { info.limits.max_group_invocations = 128; }), "plain");
}

TEST_F(Device, CpuKernelsNeed64BitIntegers) {
    DeviceDesc poor = desc();
    poor.fake = [](DeviceInfo& info) { info.features.int64 = false; };
    EXPECT_EQ(vk::Device::create(poor).value()->kernels(), Kernels::kGpu);
    poor.kernels = Kernels::kCpu;
    EXPECT_ERROR(open(poor), Code::kUnsupported, "64-bit integers");
}

TEST_F(Device, FakedLimitsReplaceTheRealOnes) {
    ContextDesc lowered = test::context_desc();
    lowered.device.fake = [](DeviceInfo& info) { info.limits.max_groups = {2, 2, 2}; };
    const auto context = test::make_context(lowered);
    const Buffer x = test::device_buffer(*context, 256);
    const Buffer y = test::device_buffer(*context, 256);
    vk::Recorder recorder(*context);
    EXPECT_OK(recorder.dispatch(test::scale(x.range(), y.range(), 128, 1)));
    EXPECT_ERROR(recorder.dispatch(test::scale(x.range(), y.range(), 129, 1)), Code::kUnsupported,
                 "1 to 2");
}

PFN_vkGetPhysicalDeviceProperties2 g_properties;

VKAPI_ATTR void VKAPI_CALL small_buffers(VkPhysicalDevice device,
                                         VkPhysicalDeviceProperties2* out) {
    g_properties(device, out);
    auto* next = static_cast<VkPhysicalDeviceMaintenance4Properties*>(out->pNext);
    if (next->sType == VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MAINTENANCE_4_PROPERTIES)
        next->maxBufferSize = 3U << 20;
}

TEST_F(Device, TheLargestBufferBoundsAllocationsAndBindings) {
    g_properties = instance_->get_properties2;
    instance_->get_properties2 = small_buffers;
    const DeviceInfo info = describe_devices(*instance_).value().at(0);
    instance_->get_properties2 = g_properties;
    if (info.vulkan_version < VK_API_VERSION_1_3) GTEST_SKIP() << "the driver need not know it";
    EXPECT_EQ(info.limits.max_buffer_bytes, 3U << 20);
    EXPECT_EQ(info.limits.max_allocation_bytes, 3U << 20);
    EXPECT_EQ(info.limits.max_storage_buffer_bytes, 3U << 20);

    ContextDesc lowered = test::context_desc();
    lowered.device.fake = [](DeviceInfo& one) { one.limits.max_buffer_bytes = 1U << 20; };
    const auto context = test::make_context(lowered);
    EXPECT_EQ(context->device().info().limits.max_storage_buffer_bytes, 1U << 20);
    EXPECT_ERROR(context->memory().allocate(2U << 20, MemoryKind::kDevice, "x"), Code::kUnsupported,
                 "at most 1048576 at once");
    EXPECT_OK(context->memory().allocate(1U << 19, MemoryKind::kDevice, "x").status());
}

TEST_F(Device, StorageBuffersAreCountedPerShader) {
    ContextDesc few = test::context_desc();
    few.device.fake = [](DeviceInfo& info) { info.limits.max_storage_buffers = 1; };
    const auto context = test::make_context(few);
    const std::vector<SpecConstant> constants{{params::kWorkgroupSizeId, 64}};
    EXPECT_OK(context->pipelines().get("test_texel", constants).status());
    const auto refused = context->pipelines().get("test_scale", constants);
    EXPECT_ERROR(refused, Code::kUnsupported, "shader test_scale needs 2 storage buffers");
    EXPECT_HAS(refused.status().message(), "has 1 for a shader");
}

TEST_F(Device, SharesOneInstancePerChoiceOfValidation) {
    EXPECT_EQ(Instance::get(test::validation_on()).value(), instance_);
    if (test::validation_on()) {
        EXPECT_NE(Instance::get(false).value(), instance_);
    }
}

TEST_F(Device, TimesMustBeNumbers) {
    for (const char* name : {"SPLAT_TIMEOUT_SCALE", "SPLAT_MAX_SUBMIT_MS"}) {
        test::set_variable(name, "soon");
        EXPECT_ERROR(Context::create(test::context_desc()), Code::kInvalidArgument, name);
        test::unset_variable(name);
    }
}

TEST_F(Device, TheEnvironmentBoundsSubmits) {
    DeviceDesc wish = desc();
    wish.max_submit_ns = 40'000'000;
    EXPECT_DOUBLE_EQ(need(vk::Device::create(wish))->pace.submit_seconds(), 0.04);
    test::set_variable("SPLAT_MAX_SUBMIT_MS", "30");
    EXPECT_DOUBLE_EQ(need(vk::Device::create(wish))->pace.submit_seconds(), 0.03);
    test::unset_variable("SPLAT_MAX_SUBMIT_MS");
}

TEST_F(Device, VulkanResultsBecomeStatusCodes) {
    const auto device = need(vk::Device::create(desc()));
    EXPECT_OK(device->check(VK_SUCCESS, "vkX"));
    EXPECT_OK(device->check(VK_INCOMPLETE, "vkX"));
    const std::pair<VkResult, Code> cases[] = {
        {VK_ERROR_OUT_OF_HOST_MEMORY, Code::kOutOfHostMemory},
        {VK_ERROR_OUT_OF_DEVICE_MEMORY, Code::kOutOfDeviceMemory},
        {VK_ERROR_FRAGMENTED_POOL, Code::kOutOfDeviceMemory},
        {VK_ERROR_TOO_MANY_OBJECTS, Code::kOutOfDeviceMemory},
        {VK_ERROR_FEATURE_NOT_PRESENT, Code::kUnsupported},
        {VK_ERROR_FRAGMENTATION, Code::kOutOfDeviceMemory},
        {VK_ERROR_UNKNOWN, Code::kInternal},
    };
    for (const auto& [result, code] : cases)
        EXPECT_ERROR(device->check(result, "vkX"), code, "vkX");
    EXPECT_ERROR(device->check(VK_ERROR_UNKNOWN, "vkX"), Code::kInternal, "VK_ERROR_UNKNOWN (-13)");
    EXPECT_ERROR(device->check(VK_ERROR_UNKNOWN, "vkCreateComputePipelines"), Code::kInternal,
                 "update the driver, use plain kernels");
    EXPECT_OK(device->alive());
    EXPECT_ERROR(device->check(VK_ERROR_DEVICE_LOST, "vkX"), Code::kDeviceLost, "vkX");
    EXPECT_ERROR(device->alive(), Code::kDeviceLost, "earlier call");
}

#if SPLAT_FAULT_POINTS
TEST_F(Device, FailuresToOpenAreClean) {
    DeviceDesc one = desc();
    one.select = DeviceSelect::kByIndex;
    one.index = test::shared_context()->device().info().index;
    fault::arm("vk.create_device", 1, 1);
    EXPECT_ERROR(open(one), Code::kOutOfDeviceMemory, "vkCreateDevice");
    EXPECT_EQ(fault::disarm(), 1U);
    EXPECT_OK(open(desc()));
}
#endif

}  // namespace
}  // namespace splat::vk
