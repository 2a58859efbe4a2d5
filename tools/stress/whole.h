#pragma once

#include "stress/stress.h"

namespace vkrun::stress {

/// Complete training steps, from a network by its head and the rasterizer to a loss: the gradient in float64 against
/// differences of the loss, and that of a device against float64.
void stress_whole(Run& run);

}  // namespace vkrun::stress
