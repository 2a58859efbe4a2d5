#pragma once

#include <string>
#include <vector>

/// What the system knows of Vulkan and of GPUs, without Vulkan.
namespace splat::os {

/// The file of the Vulkan loader, by the name that the system seeks it by.
std::string vulkan_loader();

/// The files of drivers that the loader looks at unless a variable names others. Source: "Driver Discovery" in the
/// loader's description of its interface to drivers.
std::vector<std::string> vulkan_drivers();

struct Gpu {
    std::string name;
    bool may_open = true;  ///< by this user
};
/// GPUs that the system has a driver of the kernel for; of NVIDIA's own, where nothing lists them, one.
std::vector<Gpu> gpus();

}  // namespace splat::os
