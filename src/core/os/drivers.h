#pragma once

#include <string>

/// What to do where Vulkan, or a folder for caches, is missing.
namespace splat::os {

enum class System { kLinux, kWindows, kMac };

#if defined(_WIN32)
inline constexpr System kSystem = System::kWindows;
#elif defined(__APPLE__)
inline constexpr System kSystem = System::kMac;
#else
inline constexpr System kSystem = System::kLinux;
#endif

/// The end of a sentence, for where there is no driver or no device.
std::string install_driver(System system = kSystem);
/// The same, for where the Vulkan loader cannot be loaded, and for where files of drivers name what cannot be.
std::string install_loader(System system = kSystem);
std::string reinstall_driver(System system = kSystem);
/// A sentence, for where the Vulkan loader cannot be loaded.
std::string no_loader(System system = kSystem);

/// Why cache_folder() gives none, and how another one is named.
std::string no_cache(System system = kSystem);
std::string name_cache(System system = kSystem);

}  // namespace splat::os
