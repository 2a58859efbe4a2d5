#pragma once

#include <cstdint>
#include <optional>
#include <span>

#include "vk/device.h"

namespace splat::vk {

/// What an application must enable on a device.
struct Requirements {
    std::uint32_t queue_family = 0;
    std::span<const char* const> extensions;  ///< they live for ever
};

/// Set what the library uses in a chain of features for vkCreateDevice, and say what else is needed. Errors:
/// kInvalidArgument for a chain without a place for it, or a physical device of another instance; kUnsupported where
/// the device lacks it.
Result<Requirements> require_of(const Adopted& from, void* features);

/// What is enabled on an application's device.
struct Enabled {
    std::uint32_t index = 0;  ///< the physical device's in its instance
    bool int64 = false;
    bool external_memory = false;
};

/// Errors: kInvalidArgument for handles that Vulkan does not know, kUnsupported with the list of all that is missing.
Result<Enabled> check_adopted(const Adopted& from);

}  // namespace splat::vk
