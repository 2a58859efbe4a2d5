#include "vk/caller/adopted.h"

#include "core/log.h"
#include "vk/caller/requirements.h"

namespace splat::vk {

Result<std::unique_ptr<Device>> Device::adopt(const DeviceDesc& desc) {
    const Adopted& from = *desc.adopted;
    SPLAT_ASSIGN(const Enabled enabled, check_adopted(from));
    SPLAT_ASSIGN(const std::shared_ptr<Instance> instance, Instance::adopt(from));
    std::unique_ptr<Device> device(new Device);
    device->instance_ = instance;
    device->physical_ = static_cast<VkPhysicalDevice>(from.physical_device);
    DeviceInfo& info = device->info_;
    info = describe_device(*instance, device->physical_, enabled.index, from.queue_family);
    info.vulkan_version = std::min(info.vulkan_version, from.api_version);
    info.features.int64 = info.features.int64 && enabled.int64;
    info.features.external_memory = info.features.external_memory && enabled.external_memory;
    info.kernels = best_kernels(info);
    SPLAT_TRY(device->choose(desc));
    device->spare.reserve(kMostSpare);  // destructors fill it
    SPLAT_TRY(instance->load(device->vk, static_cast<VkDevice>(from.device)));
    instance->get_memory_properties(device->physical_, &device->memory_);
    device->lock_ = from.lock;
    device->adopted_ = true;
    device->queue_ = static_cast<VkQueue>(from.queue);
    device->device_ = static_cast<VkDevice>(from.device);
    log(LogLevel::kInfo, format("the application's device: %s (%s, %s), %s kernels",
                                info.name.c_str(), device_kind_name(info.kind), info.driver.c_str(),
                                kernels_text(device->kernels_).c_str()));
    return device;
}

}  // namespace splat::vk
