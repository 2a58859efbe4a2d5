#include "scene/select.h"

#include <algorithm>
#include <functional>
#include <limits>
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

bool finite(const std::vector<float>& values, std::size_t i, std::size_t each) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * each);
    return std::all_of(first, first + static_cast<std::ptrdiff_t>(each),
                       [](float value) { return std::isfinite(value); });
}

bool is_zero(const std::vector<float>& values, std::size_t i, std::size_t each) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i * each);
    return std::all_of(first, first + static_cast<std::ptrdiff_t>(each),
                       [](float value) { return value == 0; });
}

void append(std::vector<float>& to, const std::vector<float>& from) {
    to.insert(to.end(), from.begin(), from.end());
}

/// The lowest 21 bits, with two zeros between any two of them.
std::uint64_t spread(std::uint64_t x) {
    std::uint64_t result = 0;
    for (unsigned bit = 0; bit < 21; ++bit) result |= ((x >> bit) & 1U) << (3 * bit);
    return result;
}

Box finite_bounds(const Gaussians& g) {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    Box box{{kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}};
    for (std::size_t i = 0; i < g.count(); ++i) {
        if (!finite(g.means, i, 3)) continue;
        for (std::size_t k = 0; k < 3; ++k) {
            box.low[k] = std::min(box.low[k], static_cast<double>(g.means[i * 3 + k]));
            box.high[k] = std::max(box.high[k], static_cast<double>(g.means[i * 3 + k]));
        }
    }
    return box;
}

std::uint64_t morton_code(const Gaussians& g, std::size_t i, const Box& box) {
    constexpr double kCells = 2097151;  // 2^21 - 1
    if (!finite(g.means, i, 3)) return ~std::uint64_t{0};
    std::uint64_t code = 0;
    for (std::size_t k = 0; k < 3; ++k) {
        const double size = box.high[k] - box.low[k];
        const double place =
            size > 0 ? (static_cast<double>(g.means[i * 3 + k]) - box.low[k]) / size : 0;
        code |= spread(static_cast<std::uint64_t>(place * kCells)) << k;
    }
    return code;
}

}  // namespace

Result<Gaussians> crop(const Gaussians& g, const Box& box) {
    SPLAT_TRY(check_arrays(g));
    for (std::size_t k = 0; k < 3; ++k)
        if (!(box.low[k] <= box.high[k]))
            return error(Code::kInvalidArgument,
                         "crop: axis %c from %g to %g, expected low <= high",
                         static_cast<char>('x' + k), box.low[k], box.high[k]);
    return select(g, [&](std::size_t i) {
        for (std::size_t k = 0; k < 3; ++k) {
            const auto place = static_cast<double>(g.means[i * 3 + k]);
            if (!std::isfinite(place) || place < box.low[k] || place > box.high[k]) return false;
        }
        return true;
    });
}

Result<Gaussians> filter_by_opacity(const Gaussians& g, double least) {
    SPLAT_TRY(check_arrays(g));
    if (!(least >= 0 && least <= 1))
        return error(Code::kInvalidArgument, "opacity threshold %g, expected 0 to 1", least);
    return select(g, [&](std::size_t i) {
        return opacity_of(static_cast<double>(g.opacity_logits[i])) >= least;
    });
}

Result<Gaussians> remove_invalid(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    const std::size_t each = std::size_t{sh_coefficients(g.sh_degree)} * 3;
    return select(g, [&](std::size_t i) {
        return finite(g.means, i, 3) && finite(g.log_scales, i, 3) && finite(g.rotations, i, 4) &&
               !is_zero(g.rotations, i, 4) && !std::isnan(g.opacity_logits[i]) &&
               finite(g.sh, i, each);
    });
}

Result<Gaussians> merge(const std::vector<Gaussians>& scenes) {
    Gaussians all;
    for (const Gaussians& scene : scenes) {
        SPLAT_TRY(check_arrays(scene));
        all.sh_degree = std::max(all.sh_degree, scene.sh_degree);
    }
    for (const Gaussians& scene : scenes) {
        append(all.means, scene.means);
        append(all.log_scales, scene.log_scales);
        append(all.rotations, scene.rotations);
        append(all.opacity_logits, scene.opacity_logits);
        append(all.sh, with_sh_degree(scene, all.sh_degree).sh);
    }
    return all;
}

Result<Gaussians> sort_morton(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    const Box box = finite_bounds(g);
    std::vector<std::uint64_t> codes(g.count());
    for (std::size_t i = 0; i < g.count(); ++i) codes[i] = morton_code(g, i, box);
    std::vector<std::size_t> order(g.count());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return codes[a] < codes[b]; });
    return gather(g, order);
}

}  // namespace splat::scene
