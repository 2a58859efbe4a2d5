#include "prior_scores/morphology.h"

#include <algorithm>

namespace splat::prior_scores {
namespace {

/// Each pixel becomes 1 if any of the 3 x 3 around it has the value `of`, else 0.
std::vector<std::uint8_t> any_around(std::span<const std::uint8_t> mask, std::size_t height,
                                     std::size_t width, bool of) {
    std::vector<std::uint8_t> out(mask.size());
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            for (std::size_t row = y - (y > 0 ? 1 : 0); row < std::min(y + 2, height); ++row)
                for (std::size_t column = x - (x > 0 ? 1 : 0); column < std::min(x + 2, width);
                     ++column)
                    if ((mask[row * width + column] != 0) == of) out[y * width + x] = 1;
    return out;
}

std::vector<std::uint8_t> dilated(std::span<const std::uint8_t> mask, std::size_t height,
                                  std::size_t width) {
    return any_around(mask, height, width, true);
}

std::vector<std::uint8_t> eroded(std::span<const std::uint8_t> mask, std::size_t height,
                                 std::size_t width) {
    std::vector<std::uint8_t> out = any_around(mask, height, width, false);
    for (std::uint8_t& pixel : out) pixel = pixel == 0 ? 1 : 0;
    return out;
}

}  // namespace

std::vector<std::uint8_t> closing(std::span<const std::uint8_t> mask, std::size_t height,
                                  std::size_t width) {
    return eroded(dilated(mask, height, width), height, width);
}

std::vector<std::uint8_t> opening(std::span<const std::uint8_t> mask, std::size_t height,
                                  std::size_t width) {
    return dilated(eroded(mask, height, width), height, width);
}

}  // namespace splat::prior_scores
