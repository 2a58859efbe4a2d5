#include "data/planes/plane_channels.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

namespace splat::data {
namespace {

struct CountedPlane {
    std::uint32_t numbers = 0;  ///< the four bytes
    std::size_t first = 0;      ///< pixel
    std::size_t pixels = 0;
};

/// The four bytes of a pixel; 0 without a plane.
template <class Sample>
std::uint32_t numbers_of(std::span<const Sample> map, std::size_t pixel) {
    const auto four = map.subspan(4 * pixel, 4);
    std::uint32_t numbers = 0;
    for (const Sample sample : four) numbers = (numbers << 8U) | sample;
    return four[3] == 0 ? 0 : numbers;
}

double length_of_normal(std::span<const std::uint16_t> pixel) {
    double squared = 0;
    for (const std::uint16_t sample : pixel.first(3))
        squared += (2 * sample / 255.0 - 1) * (2 * sample / 255.0 - 1);
    return std::sqrt(squared);
}

}  // namespace

Status check_planes(std::span<const std::uint16_t> map, std::uint32_t width) {
    std::set<std::uint32_t> known;
    std::uint32_t last = 0;
    for (std::size_t i = 0; 4 * i < map.size(); ++i) {
        const std::uint32_t numbers = numbers_of(map, i);
        if (numbers == 0 || numbers == last) continue;
        last = numbers;
        if (!known.insert(numbers).second) continue;
        const double length = length_of_normal(map.subspan(4 * i, 4));
        std::string problem;
        if (known.size() > kMostPlanes)
            problem = format("begins plane %zu, expected at most %u", known.size(), kMostPlanes);
        else if (length < kLeastNormal)
            problem =
                format("is on a plane whose normal has the length %.2g, expected about 1", length);
        if (!problem.empty())
            return damaged(
                "pixel (%zu, %zu) %s: maps that were resized mix planes; make them with 'vkrun "
                "priors plane'",
                i % width, i / width, problem.c_str());
    }
    return {};
}

void plane_channels(std::span<const std::uint8_t> map, std::span<float> channels) {
    const std::size_t area = map.size() / 4;
    std::vector<CountedPlane> planes;
    std::map<std::uint32_t, std::size_t> places;  // places in `planes` by numbers
    std::vector<std::uint32_t> numbers(area);     // 0: no plane
    std::size_t place = 0;
    for (std::size_t i = 0; i < area; ++i) {
        numbers[i] = numbers_of(map, i);
        if (numbers[i] == 0) continue;
        if (i == 0 || numbers[i] != numbers[i - 1]) {
            const auto [at, fresh] = places.try_emplace(numbers[i], planes.size());
            if (fresh) planes.push_back({numbers[i], i, 0});
            place = at->second;
        }
        ++planes[place].pixels;
    }
    std::ranges::sort(planes, [](const CountedPlane& a, const CountedPlane& b) {
        return a.pixels != b.pixels ? a.pixels > b.pixels : a.first < b.first;
    });
    for (std::size_t i = 0; i < planes.size(); ++i) places[planes[i].numbers] = i;
    float id = 0;
    for (std::size_t i = 0; i < area; ++i) {
        const bool none = numbers[i] == 0;
        if (!none && (i == 0 || numbers[i] != numbers[i - 1]))
            id = static_cast<float>(places[numbers[i]] + 1) / static_cast<float>(planes.size());
        for (std::size_t c = 0; c < 4; ++c)
            channels[c * area + i] = none ? 0 : static_cast<float>(map[4 * i + c]) / 255.0F;
        channels[4 * area + i] = none ? 0 : id;
    }
}

}  // namespace splat::data
