#pragma once

#include <memory>

#include "api/core/self_test.h"
#include "api/on_device.h"
#include "splat.h"

namespace splat::api {

/// The object behind splat_device.
struct DeviceObject : OfDevice {
    using OfDevice::OfDevice;
    std::unique_ptr<vk::DeferredWork> saving;  ///< saves pipelines for splat_device_destroy
    KernelTests tests;

    /// Call it before an object of these KernelFamily bits is made.
    Status test(unsigned families) { return test_kernels(*context, tests, families); }
};

/// Open the device that a checked desc selects; zeros: the best one.
Result<std::shared_ptr<DeviceObject>> open_device(const splat_device_desc& desc);

}  // namespace splat::api
