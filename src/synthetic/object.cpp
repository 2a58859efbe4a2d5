#include "synthetic/object.h"

#include <algorithm>
#include <cmath>

namespace splat::synthetic {

Vec3 hsv(const Vec3& color) {
    const auto& [hue, saturation, value] = color;
    Vec3 rgb{};
    for (std::size_t i = 0; i < 3; ++i) {
        const double offset[] = {5, 3, 1};
        const double k = std::fmod(offset[i] + hue * 6, 6.0);
        const double drop = std::clamp(std::min(k, 4 - k), 0.0, 1.0);
        rgb[i] = value * (1 - saturation * drop);
    }
    return rgb;
}

Solids fitted(const Solids& solids) {
    Vec3 center{};
    for (std::size_t i = 0; i < 3; ++i) {
        Vec3 direction{};
        direction[i] = 1;
        double high = support(solids.front(), direction);
        double low = -support(solids.front(), -direction);
        for (const Solid& solid : solids) {
            high = std::max(high, support(solid, direction));
            low = std::min(low, -support(solid, -direction));
        }
        center[i] = (low + high) / 2;
    }
    double radius = 0;
    for (const Solid& solid : solids) radius = std::max(radius, reach(solid, center));
    Solids result;
    for (const Solid& solid : solids) {
        result.push_back(moved(solid, center, 0.5 / radius));
        find_hull(result.back());
    }
    return result;
}

}  // namespace splat::synthetic
