#pragma once

#include "api/api_calls.h"

namespace splat::test {

using PriorModel = Owned<splat_prior_model, splat_prior_model_destroy>;

/// Packed pixels of a vector.
inline splat_image bytes_map(std::vector<std::uint8_t>& bytes, std::uint32_t width,
                             std::uint32_t height, std::uint32_t channels) {
    return {bytes.data(), bytes.size(), SPLAT_PIXEL_U8, width, height, channels, 0, 0, 0};
}
inline splat_image float_map(std::vector<float>& values, std::uint32_t width, std::uint32_t height,
                             std::uint32_t channels) {
    return {values.data(), 4 * values.size(), SPLAT_PIXEL_F32, width, height, channels, 0, 0, 0};
}

}  // namespace splat::test
