#include "core/os/drivers.h"

namespace splat::os {

std::string install_driver(System system) {
    switch (system) {
        case System::kWindows:
            return "install the current driver of the GPU's maker (NVIDIA, AMD, Intel), which "
                   "brings vulkan-1.dll; without a GPU, install the Vulkan runtime and Mesa's "
                   "lavapipe for Windows, and name the path of its lvp_icd.x86_64.json in "
                   "VK_DRIVER_FILES, or as a DWORD 0 in the registry, in "
                   "HKEY_LOCAL_MACHINE\\SOFTWARE\\Khronos\\Vulkan\\Drivers";
        case System::kMac:
            return "install MoltenVK, which is in the Vulkan SDK, or `brew install molten-vk`";
        case System::kLinux:
            break;
    }
    return "install the driver of the GPU's maker (NVIDIA on Debian: `apt-get install "
           "nvidia-vulkan-icd`, from non-free); for AMD, Intel and, by software, machines without "
           "a GPU `apt-get install mesa-vulkan-drivers` (Debian, Ubuntu) or `dnf install` with the "
           "same name (Fedora)";
}

std::string install_loader(System system) {
    switch (system) {
        case System::kWindows:
            return install_driver(system);
        case System::kMac:
            return "install the Vulkan SDK, or `brew install vulkan-loader`";
        case System::kLinux:
            break;
    }
    return "install it (Debian and Ubuntu: `apt-get install libvulkan1`, Fedora: `dnf install "
           "vulkan-loader`)";
}

std::string reinstall_driver(System system) {
    if (system == System::kWindows) return "install the driver of the GPU's maker again";
    return "reinstall the package of these files (`dpkg -S FILE` names it), for Mesa's `apt-get "
           "install --reinstall mesa-vulkan-drivers`; remove files whose package is gone";
}

std::string no_loader(System system) {
    const std::string install = install_loader(system);
    switch (system) {
        case System::kWindows:
            return "no Vulkan loader found (vulkan-1.dll): " + install;
        case System::kMac:
            return "no Vulkan loader found (libvulkan.1.dylib): " + install + "; and " +
                   install_driver(system);
        case System::kLinux:
            break;
    }
    return "no Vulkan loader found (libvulkan.so.1): " + install + "; and " +
           install_driver(system);
}

std::string no_cache(System system) {
    return system == System::kWindows ? "LOCALAPPDATA is not set"
                                      : "neither XDG_CACHE_HOME nor HOME is set";
}

std::string name_cache(System system) {
    return std::string("set ") + (system == System::kWindows ? "LOCALAPPDATA" : "XDG_CACHE_HOME") +
           " to a folder that can be written";
}

}  // namespace splat::os
