#pragma once

#include <splat.h>

#include <string>

#include "vkrun/cli/json.h"

namespace vkrun::bench {

/// What Vulkan itself does on a device, without libsplat's kernels: memory, ceilings and overheads.
///
/// measure  false: describe the device only
/// Returns  what the help of `vkrun bench dispatch` lists under JSON
Json measure_dispatch(const splat_device_info& info, bool measure);

std::string dispatch_table(const Json& measured);

}  // namespace vkrun::bench
