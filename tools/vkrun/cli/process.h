#pragma once

#include <cstdint>

namespace vkrun {

/// What the parent may have left out: descriptors 0 to 2 that are closed become /dev/null, so that no file gets
/// their numbers and the messages meant for them; a closed pipe ends the program silently.
void prepare_process();

/// Multiply the limits of what a file may cost when it is read, splat_decode_limits.
void scale_decode_limits(std::uint32_t factor);

}  // namespace vkrun
