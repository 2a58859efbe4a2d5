#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "vk/device.h"

namespace splat::vk {

/// Path of the pipeline cache of one device and driver in `folder`.
std::string pipeline_cache_path(const std::string& folder, const DeviceInfo& info);

/// The driver's data from the file, or nothing if it is absent, corrupt or of another device or
/// driver.
///
/// Layout, little-endian: "SPLATPC1", pipelineCacheUUID (16), driver version (4), CRC-32 of the
/// data (4), size of the data (8), data.
std::optional<std::vector<std::byte>> read_pipeline_cache(const std::string& path,
                                                          const DeviceInfo& info);

/// Replace the file as a whole (write under another name, then rename). False if that failed; the old
/// file then stays.
bool write_pipeline_cache(const std::string& path, const DeviceInfo& info,
                          const std::vector<std::byte>& data);

}  // namespace splat::vk
