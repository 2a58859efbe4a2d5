#pragma once

#include <memory>
#include <mutex>

#include "api/on_device.h"
#include "run/group.h"
#include "self_test/self_test.h"
#include "splat.h"

namespace splat::api {

using enum self_test::KernelFamily;

/// The object behind splat_device.
struct DeviceObject : OfDevice {
    using OfDevice::OfDevice;
    std::unique_ptr<vk::DeferredWork> saving;  ///< saves pipelines for splat_device_destroy
    self_test::KernelTests tests;
    std::mutex rank_mutex;
    std::weak_ptr<run::Group> rank;  ///< group of a rank's open run, if there is one

    /// Call it before an object of these KernelFamily bits is made.
    Status test(unsigned families) { return self_test::test_kernels(*context, tests, families); }

    /// Take the device for a rank while its group lives. Errors: kInvalidArgument where another rank has it: two ranks
    /// would wait for each other, one for the device and one for numbers.
    Status be_rank(const std::shared_ptr<run::Group>& group);
};

/// Open the device that a checked desc selects; zeros: the best one. `adopted`: the application's instead.
Result<std::shared_ptr<DeviceObject>> open_device(const splat_device_desc& desc,
                                                  std::optional<vk::Adopted> adopted = {});

}  // namespace splat::api
