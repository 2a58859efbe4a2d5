#include "scene/select.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "scene/activate.h"
#include "scene/arrays.h"

namespace splat::scene {
namespace {

using Keep = std::function<bool(std::size_t)>;

Gaussians select(const Gaussians& g, const Keep& keep) {
    std::vector<std::size_t> indices;
    for (std::size_t i = 0; i < g.count(); ++i)
        if (keep(i)) indices.push_back(i);
    return gather(g, indices);
}

/// The lowest 21 bits, with two zeros between any two of them.
std::uint64_t spread(std::uint64_t x) {
    std::uint64_t result = 0;
    for (unsigned bit = 0; bit < 21; ++bit) result |= ((x >> bit) & 1U) << (3 * bit);
    return result;
}

std::uint64_t morton_code(const Gaussians& g, std::size_t i, const Box& box) {
    constexpr double kCells = 2097151;  // 2^21 - 1
    const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
    if (!is_finite(mean)) return ~std::uint64_t{0};
    std::uint64_t code = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double size = box.high[k] - box.low[k];
        const double place = size > 0 ? (mean[k] - box.low[k]) / size : 0;
        code |= spread(static_cast<std::uint64_t>(place * kCells)) << k;
    }
    return code;
}

}  // namespace

std::vector<Vec3> finite_means(const Gaussians& g) {
    std::vector<Vec3> means;
    for (std::size_t i = 0; i < g.count(); ++i) {
        const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
        if (is_finite(mean)) means.push_back(mean);
    }
    return means;
}

Box bounds_of(const std::vector<Vec3>& points) {
    if (points.empty()) return {};
    Box box{points.front(), points.front()};
    for (const Vec3& point : points) box = {glm::min(box.low, point), glm::max(box.high, point)};
    return box;
}

Result<Gaussians> crop(const Gaussians& g, const Box& box) {
    SPLAT_TRY(check_arrays(g));
    for (std::size_t k = 0; k < 3; ++k)
        if (!(box.low[k] <= box.high[k]))
            return invalid("crop: axis %c from %g to %g, expected low <= high",
                           static_cast<char>('x' + k), box.low[k], box.high[k]);
    return select(g, [&](std::size_t i) {
        const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
        return is_finite(mean) && glm::clamp(mean, box.low, box.high) == mean;
    });
}

Result<Gaussians> crop_sphere(const Gaussians& g, const Vec3& center, double radius) {
    SPLAT_TRY(check_arrays(g));
    if (!is_finite(center))
        return invalid("crop: centre %g, %g, %g, expected finite numbers", center[0], center[1],
                       center[2]);
    if (!(radius >= 0)) return invalid("crop: radius %g, expected >= 0", radius);
    return select(g, [&](std::size_t i) {
        const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
        return is_finite(mean) && glm::length(mean - center) <= radius;
    });
}

Result<Gaussians> filter_by_opacity(const Gaussians& g, double least) {
    SPLAT_TRY(check_arrays(g));
    if (!(least >= 0 && least <= 1)) return invalid("opacity threshold %g, expected 0 to 1", least);
    return select(g, [&](std::size_t i) {
        return opacity_of(static_cast<double>(g.opacity_logits[i])) >= least;
    });
}

Result<Gaussians> remove_invalid(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    const auto of_scene = attributes(g.sh_degree);
    return select(g, [&](std::size_t i) {
        const auto is_valid = [&](const Attribute& attribute) {
            const float* const first = &(g.*attribute.array)[i * attribute.each];
            if (attribute.array == &Gaussians::opacity_logits) return !std::isnan(*first);
            return std::all_of(first, first + attribute.each,
                               [](float value) { return std::isfinite(value); });
        };
        return std::ranges::all_of(of_scene, is_valid) && length_of(rotation_at(g, i)) > 0;
    });
}

Result<Gaussians> merge(const std::vector<Gaussians>& scenes) {
    Gaussians all;
    for (const Gaussians& scene : scenes) {
        SPLAT_TRY(check_arrays(scene));
        all.sh_degree = std::max(all.sh_degree, scene.sh_degree);
    }
    if (!scenes.empty()) all.drawn_as = scenes.front().drawn_as;
    for (const Gaussians& scene : scenes) {
        const Gaussians part = with_sh_degree(scene, all.sh_degree);
        for (const Attribute& attribute : attributes(all.sh_degree)) {
            const std::vector<float>& from = part.*attribute.array;
            (all.*attribute.array).insert((all.*attribute.array).end(), from.begin(), from.end());
        }
    }
    return all;
}

std::vector<std::size_t> morton_order(const Gaussians& g) {
    const Box box = bounds_of(finite_means(g));
    std::vector<std::uint64_t> codes(g.count());
    for (std::size_t i = 0; i < g.count(); ++i) codes[i] = morton_code(g, i, box);
    std::vector<std::size_t> order(g.count());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order,
                             [&](std::size_t a, std::size_t b) { return codes[a] < codes[b]; });
    return order;
}

Result<Gaussians> sort_morton(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    return gather(g, morton_order(g));
}

}  // namespace splat::scene
