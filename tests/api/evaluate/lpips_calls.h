#pragma once

#include "api/api_calls.h"

namespace splat::test {

inline constexpr std::uint32_t kLpipsSide = 16;

/// Random weights of VGG16's and LPIPS's shapes.
Weights lpips_weights();

/// LPIPS with random weights of VGG16's and LPIPS's shapes, for images of kLpipsSide pixels.
Lpips make_lpips(const Device& device);

}  // namespace splat::test
