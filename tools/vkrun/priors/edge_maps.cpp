#include "vkrun/priors/edge_maps.h"

#include <algorithm>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"

namespace vkrun {
namespace {

splat_map_filter filter_of(const std::string& name) {
    constexpr splat_map_filter kFilters[] = {SPLAT_MAP_FILTER_CANNY, SPLAT_MAP_FILTER_SOBEL,
                                             SPLAT_MAP_FILTER_SCHARR, SPLAT_MAP_FILTER_PREWITT};
    const std::vector<std::string>& names = edge_operators();
    return kFilters[std::find(names.begin(), names.end(), name) - names.begin()];
}

}  // namespace

const std::vector<std::string>& edge_operators() {
    static const std::vector<std::string> names = {"canny", "sobel", "scharr", "prewitt"};
    return names;
}

std::vector<std::string> default_operators(const std::string& map) {
    if (map == "edges") return edge_operators();
    if (map == "normal") return {"sobel", "scharr", "prewitt"};
    return {map == "mask" ? "canny" : "sobel"};
}

LoadedDepth gray_plane_of(const splat_image& picture) {
    // 0.299 R + 0.587 G + 0.114 B in units of 2^-14, rounded.
    constexpr unsigned kRed = 4899, kGreen = 9617, kBlue = 1868, kHalf = 1U << 13U, kShift = 14;
    const std::size_t pixels = std::size_t{picture.width} * picture.height;
    const auto* bytes = static_cast<const std::uint8_t*>(picture.pixels);
    LoadedDepth gray;
    gray.values.resize(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const std::uint8_t* const pixel = bytes + i * picture.channels;
        const unsigned value =
            picture.channels < 3
                ? pixel[0]
                : (kRed * pixel[0] + kGreen * pixel[1] + kBlue * pixel[2] + kHalf) >> kShift;
        gray.values[i] = static_cast<float>(value) / 255;
    }
    gray.image = interleaved_image(gray.values.data(), picture.width, picture.height, 1);
    return gray;
}

std::vector<float> edges_of(const splat_image& plane, const std::vector<std::string>& operators) {
    const std::size_t pixels = std::size_t{plane.width} * plane.height;
    std::vector<float> all(pixels * operators.size());
    std::vector<float> one(pixels);
    splat_image filtered = interleaved_image(one.data(), plane.width, plane.height, 1);
    for (std::size_t k = 0; k < operators.size(); ++k) {
        check(splat_prior_filter(&plane, filter_of(operators[k]), &filtered), kBadData);
        for (std::size_t i = 0; i < pixels; ++i) all[i * operators.size() + k] = one[i];
    }
    return all;
}

}  // namespace vkrun
