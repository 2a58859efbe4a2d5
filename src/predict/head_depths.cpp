#include "predict/head_depths.h"

#include <algorithm>
#include <cmath>

#include "data/resample.h"

namespace splat::predict {
namespace {

/// The first channel of the central square; all bits of the file, or the numbers that were given.
std::vector<float> central_square(const data::NamedImage& map, std::uint32_t side) {
    const io::Image& image = map.image;
    const std::size_t left = (image.width - side) / 2, top = (image.height - side) / 2;
    std::vector<float> square;
    for (std::size_t y = 0; y < side; ++y)
        for (std::size_t x = 0; x < side; ++x) {
            const std::size_t pixel = (top + y) * image.width + left + x;
            square.push_back(map.exact.empty()
                                 ? static_cast<float>(image.samples[pixel * image.channels])
                                 : map.exact[pixel]);
        }
    return square;
}

}  // namespace

void to_scene_depths(const config::ModelConfig& network, bool farther, std::span<float> numbers) {
    const auto near = static_cast<double>(network.znear), far = static_cast<double>(network.zfar);
    for (float& number : numbers) {
        const auto part = static_cast<double>(number);
        number = static_cast<float>(farther ? near + part * (far - near)
                                            : 1 / (1 / far + part * (1 / near - 1 / far)));
    }
}

Result<std::vector<float>> head_depths(const config::ModelConfig& network,
                                       const data::NamedImage& map, const io::Image& image) {
    const std::uint32_t w = map.image.width, h = map.image.height;
    const double ratio = static_cast<double>(image.width) / image.height;
    if (std::abs(ratio * h - w) > 1 + ratio)  // a side may be rounded
        return invalid("%s is %u x %u pixels, expected the proportion of the image's %u x %u",
                       map.name.c_str(), w, h, image.width, image.height);
    const std::uint32_t from = std::min(w, h), to = network.resolution;
    const std::vector<float> square = central_square(map, from);
    const auto [nearest, farthest] = std::ranges::minmax(square);
    if (!(farthest > nearest))  // after scaling its roundings would be depths
        return invalid("%s has one depth everywhere, %g, expected a map of several",
                       map.name.c_str(), static_cast<double>(farthest));
    SPLAT_ASSIGN(const std::vector<double> scaled,
                 data::resample_values<float>(square, from, from, 1, to, to,
                                              data::ValueFilter::kPillowLanczos));
    const auto [least, most] = std::ranges::minmax(scaled);
    std::vector<float> depths;
    for (const double value : scaled)
        depths.push_back(static_cast<float>((value - least) / (most - least)));
    to_scene_depths(network, network.depth_farther, depths);
    return depths;
}

}  // namespace splat::predict
