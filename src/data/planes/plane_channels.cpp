#include "data/planes/plane_channels.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <vector>

namespace splat::data {
namespace {

struct CountedPlane {
    std::uint32_t numbers = 0;  ///< the four bytes
    std::size_t first = 0;      ///< pixel
    std::size_t pixels = 0;
};

}  // namespace

void plane_channels(std::span<const std::uint8_t> map, std::span<float> channels) {
    const std::size_t area = map.size() / 4;
    std::vector<CountedPlane> planes;
    std::map<std::uint32_t, std::size_t> places;  // of the numbers, in `planes`
    std::vector<std::uint32_t> numbers(area);     // 0: no plane
    for (std::size_t i = 0; i < area; ++i) {
        if (map[4 * i + 3] == 0) continue;
        std::memcpy(&numbers[i], &map[4 * i], 4);
        const auto [at, fresh] = places.emplace(numbers[i], planes.size());
        if (fresh) planes.push_back({numbers[i], i, 0});
        ++planes[at->second].pixels;
    }
    std::ranges::sort(planes, [](const CountedPlane& a, const CountedPlane& b) {
        return a.pixels != b.pixels ? a.pixels > b.pixels : a.first < b.first;
    });
    std::map<std::uint32_t, float> ids;
    for (std::size_t i = 0; i < planes.size(); ++i)
        ids[planes[i].numbers] = static_cast<float>(i + 1) / static_cast<float>(planes.size());
    for (std::size_t i = 0; i < area; ++i) {
        const bool none = numbers[i] == 0;
        for (std::size_t c = 0; c < 4; ++c)
            channels[c * area + i] = none ? 0 : static_cast<float>(map[4 * i + c]) / 255.0F;
        channels[4 * area + i] = none ? 0 : ids[numbers[i]];
    }
}

}  // namespace splat::data
