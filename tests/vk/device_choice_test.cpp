#include "vk/device_choice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "core/os/drivers.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/log_capture.h"

namespace splat::vk {
namespace {

using Indices = std::vector<std::uint32_t>;

/// Devices of these kinds, each of a GPU and a conformant driver of its own.
std::vector<DeviceInfo> devices(std::initializer_list<DeviceKind> kinds) {
    std::vector<DeviceInfo> infos;
    for (const DeviceKind kind : kinds) {
        DeviceInfo info;
        info.index = static_cast<std::uint32_t>(infos.size());
        info.kind = kind;
        info.uuid.fill(static_cast<std::uint8_t>(info.index + 1));
        infos.push_back(info);
    }
    return infos;
}

Indices order(std::vector<DeviceInfo>& infos) {
    pass_over(infos);
    return need(devices_to_try({}, infos));
}

TEST(DeviceChoice, KindsComeInOrderThenIndices) {
    auto infos = devices({DeviceKind::kCpu, DeviceKind::kDiscrete, DeviceKind::kIntegrated,
                          DeviceKind::kDiscrete, DeviceKind::kVirtual});
    EXPECT_EQ(order(infos), (Indices{1, 3, 2, 4, 0}));
    for (const DeviceInfo& info : infos) EXPECT_EQ(info.passed_over, "");
}

TEST(DeviceChoice, ConformantDriversComeFirstAndCpusLast) {
    auto infos = devices({DeviceKind::kDiscrete, DeviceKind::kIntegrated, DeviceKind::kCpu});
    infos[0].conformant = false;
    EXPECT_EQ(order(infos), (Indices{1, 0, 2}));
    EXPECT_HAS(infos[0].passed_over, "conformance");
    EXPECT_EQ(infos[1].passed_over, "");
    infos[1].conformant = false;
    EXPECT_EQ(order(infos), (Indices{0, 1, 2}));
    EXPECT_EQ(infos[0].passed_over, "") << "no other GPU is better";
}

TEST(DeviceChoice, OneDriverOfEachGpuIsChosen) {
    auto infos = devices(
        {DeviceKind::kDiscrete, DeviceKind::kDiscrete, DeviceKind::kDiscrete, DeviceKind::kCpu});
    infos[0].driver_id = VK_DRIVER_ID_MESA_DOZEN;
    infos[0].conformant = false;
    infos[1].driver_id = VK_DRIVER_ID_MESA_RADV;
    infos[2].driver_id = VK_DRIVER_ID_AMD_OPEN_SOURCE;
    infos[1].uuid = infos[2].uuid = infos[0].uuid;
    EXPECT_EQ(order(infos), (Indices{1, 2, 0, 3}));
    EXPECT_HAS(infos[0].passed_over, "device 1 is the same GPU");
    EXPECT_HAS(infos[2].passed_over, "device 1 is the same GPU");
    EXPECT_EQ(infos[1].passed_over + infos[3].passed_over, "");

    infos[1].reason = "Vulkan 1.1";
    EXPECT_EQ(order(infos), (Indices{2, 0, 3})) << "an unusable driver takes no GPU away";
    infos[2].conformant = infos[3].conformant = false;
    EXPECT_EQ(order(infos), (Indices{2, 0, 3})) << "Dozen is the last GPU";
}

TEST(DeviceChoice, EqualGpusOfOneDriverAreTwo) {
    auto infos = devices({DeviceKind::kDiscrete, DeviceKind::kDiscrete});
    infos[1].uuid = infos[0].uuid;
    EXPECT_EQ(order(infos), (Indices{0, 1}));
    EXPECT_EQ(infos[1].passed_over, "");
    infos[1].driver_id = VK_DRIVER_ID_MESA_NVK;
    infos[0].uuid = infos[1].uuid = {};
    EXPECT_EQ(order(infos), (Indices{0, 1}));
    EXPECT_EQ(infos[1].passed_over, "") << "drivers that know no UUID";
}

TEST(DeviceChoice, NamedDevicesAreNotReplaced) {
    auto infos = devices({DeviceKind::kDiscrete, DeviceKind::kDiscrete, DeviceKind::kCpu});
    infos[0].driver_id = VK_DRIVER_ID_MESA_DOZEN;
    infos[0].conformant = false;
    infos[0].uuid = infos[1].uuid;
    infos[2].reason = "Vulkan 1.1";
    pass_over(infos);
    DeviceDesc desc;
    desc.select = DeviceSelect::kByIndex;
    EXPECT_EQ(need(devices_to_try(desc, infos)), Indices{0});
    desc.select = DeviceSelect::kByUuid;
    desc.uuid = infos[0].uuid;
    EXPECT_EQ(need(devices_to_try(desc, infos)), Indices{1}) << "the better driver";
    desc.select = DeviceSelect::kByKind;
    desc.kind = DeviceKind::kCpu;
    EXPECT_ERROR(devices_to_try(desc, infos), Code::kUnsupported, "Vulkan 1.1; install");
    desc.kind = DeviceKind::kVirtual;
    EXPECT_ERROR(devices_to_try(desc, infos), Code::kNoDevice, "of kind virtual");
    EXPECT_ERROR(devices_to_try(desc, {}), Code::kNoDevice, "none; install");
    infos[0].reason = infos[1].reason = "Vulkan 1.1";
    EXPECT_ERROR(devices_to_try({}, infos), Code::kNoDevice, "not usable: Vulkan 1.1; install");
    infos[0].reason = "";
    desc.kind = DeviceKind::kVirtual;
    EXPECT_ERROR(devices_to_try(desc, infos), Code::kNoDevice, "not usable: Vulkan 1.1");
}

PFN_vkCreateDevice g_create;
int g_failures;                         ///< calls of vkCreateDevice still to fail
std::vector<std::string> g_extensions;  ///< which the last call asked for

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                             const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* host, VkDevice* device) {
    g_extensions.assign(info->ppEnabledExtensionNames,
                        info->ppEnabledExtensionNames + info->enabledExtensionCount);
    if (g_failures == 0) return g_create(physical, info, host, device);
    --g_failures;
    return VK_ERROR_INITIALIZATION_FAILED;
}

VKAPI_ATTR VkResult VKAPI_CALL only_subset(VkPhysicalDevice, const char*, std::uint32_t* count,
                                           VkExtensionProperties* found) {
    *count = 1;
    if (found != nullptr) *found = {"VK_KHR_portability_subset", 1};
    return VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL no_extension(VkPhysicalDevice, const char*, std::uint32_t* count,
                                            VkExtensionProperties*) {
    *count = 0;
    return VK_SUCCESS;
}

/// The instance lists one device twice, as if a machine had two.
class TwoDevices : public testing::Test {
  protected:
    void SetUp() override {
        instance_ = need(Instance::get(test::validation_on()));
        // The instance hands out a view; the vector itself is not const.
        list_ = &const_cast<std::vector<VkPhysicalDevice>&>(instance_->physical_devices());
        before_ = *list_;
        list_->assign(2, before_.at(test::shared_context()->device().info().index));
        g_create = instance_->create_device;
        get_extensions_ = instance_->get_extensions;
        instance_->create_device = create_device;
        g_failures = 0;
    }
    void TearDown() override {
        *list_ = before_;
        instance_->create_device = g_create;
        instance_->get_extensions = get_extensions_;
    }
    static DeviceDesc desc() { return test::context_desc().device; }

    std::shared_ptr<Instance> instance_;
    std::vector<VkPhysicalDevice>* list_ = nullptr;
    std::vector<VkPhysicalDevice> before_;
    PFN_vkEnumerateDeviceExtensionProperties get_extensions_ = nullptr;
};

TEST_F(TwoDevices, TheNextIsTriedWhereOneCannotBeOpened) {
    g_failures = 1;
    const test::LogCapture lines;
    EXPECT_EQ(need(Device::create(desc()))->info().index, 1U);
    EXPECT_HAS(lines.text(), "cannot be opened, so the next one is tried: vkCreateDevice");
    EXPECT_EQ(std::ranges::count(lines.text(), '\n'), 1);
    g_failures = 2;
    EXPECT_ERROR(Device::create(desc()), Code::kInternal, "VK_ERROR_INITIALIZATION_FAILED");
    g_failures = 2;
    EXPECT_ERROR(Device::create(desc()), Code::kInternal, "on device 1");
    g_failures = 1;
    DeviceDesc named = desc();
    named.select = DeviceSelect::kByIndex;
    EXPECT_ERROR(Device::create(named), Code::kInternal, "on device 0");
}

TEST_F(TwoDevices, FakesDecideTheChoice) {
    DeviceDesc faked = desc();
    faked.fake = [](DeviceInfo& info) { info.conformant = info.index == 1; };
    EXPECT_EQ(need(Device::create(faked))->info().index, 1U);
    faked.fake = [](DeviceInfo& info) { info.reason = "no queue"; };
    EXPECT_ERROR(Device::create(faked), Code::kNoDevice, "not usable: no queue");
}

TEST_F(TwoDevices, PortabilitySubsetIsEnabledWhereThereIsOne) {
    for (const auto& extensions : {only_subset, no_extension}) {
        instance_->get_extensions = extensions;
        g_failures = 2;
        EXPECT_ERROR(Device::create(desc()), Code::kInternal, "vkCreateDevice");
        EXPECT_EQ(g_extensions, extensions == only_subset
                                    ? std::vector<std::string>{"VK_KHR_portability_subset"}
                                    : std::vector<std::string>{});
    }
}

VkInstanceCreateFlags g_flags;

VKAPI_ATTR VkResult VKAPI_CALL no_driver(const VkInstanceCreateInfo* info,
                                         const VkAllocationCallbacks*, VkInstance*) {
    g_flags = info->flags;
    g_extensions.assign(info->ppEnabledExtensionNames,
                        info->ppEnabledExtensionNames + info->enabledExtensionCount);
    return VK_ERROR_INCOMPATIBLE_DRIVER;
}

VKAPI_ATTR VkResult VKAPI_CALL old_loader(const char*, std::uint32_t* count,
                                          VkExtensionProperties*) {
    *count = 0;
    return VK_SUCCESS;
}

VKAPI_ATTR VkResult VKAPI_CALL new_loader(const char*, std::uint32_t* count,
                                          VkExtensionProperties* found) {
    *count = 1;
    if (found != nullptr) *found = {VK_KHR_PORTABILITY_ENUMERATION_EXTENSION_NAME, 1};
    return VK_SUCCESS;
}

TEST(Instance, AsksForPortabilityDriversWhereTheLoaderHidesThem) {
    if (!test::validation_on()) GTEST_SKIP() << "the instance without validation is in use";
    const auto create = vkCreateInstance;
    const auto list = vkEnumerateInstanceExtensionProperties;
    vkCreateInstance = no_driver;
    vkEnumerateInstanceExtensionProperties = new_loader;
    EXPECT_ERROR(Instance::get(false), Code::kNoDevice, "VK_ERROR_INCOMPATIBLE_DRIVER");
    EXPECT_EQ(g_flags, VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR);
    EXPECT_EQ(g_extensions, std::vector<std::string>{"VK_KHR_portability_enumeration"});
    vkEnumerateInstanceExtensionProperties = old_loader;
    EXPECT_ERROR(Instance::get(false), Code::kNoDevice, os::install_driver());
    EXPECT_EQ(g_flags, 0U);
    EXPECT_TRUE(g_extensions.empty());
    vkCreateInstance = create;
    vkEnumerateInstanceExtensionProperties = list;
}

}  // namespace
}  // namespace splat::vk
