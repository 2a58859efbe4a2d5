#include "ops/conv2d_algorithm.h"

#include <algorithm>

namespace splat::ops {
namespace {

constexpr std::uint32_t kSmallestImage = 3;
/// Up to this many output channels are computed by taps, see conv2d_taps.cpp.
constexpr std::uint32_t kFewChannels = 8;
/// All levels but the coarsest of a network on images of 128 x 128: 97 % of its multiplications.
constexpr std::uint32_t kLargePixels = 32 * 32;

}  // namespace

std::int32_t conv2d_algorithm(const Conv2dDesc& desc, Conv2dPrecision precision) {
    const bool small = std::min(desc.height, desc.width) < kSmallestImage;
    if (desc.kernel != 3 || small || desc.out_channels <= kFewChannels) return 0;
    switch (precision) {
        case Conv2dPrecision::kFast:
            return 4;
        case Conv2dPrecision::kBalanced:
            return desc.height * desc.width >= kLargePixels ? 4 : 2;
        default:
            return 2;
    }
}

}  // namespace splat::ops
