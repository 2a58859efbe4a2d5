#pragma once

#include <cstdint>

namespace vkrun {

/// Multiply the limits of what a file may cost when it is read, splat_decode_limits.
void scale_decode_limits(std::uint32_t factor);

}  // namespace vkrun
