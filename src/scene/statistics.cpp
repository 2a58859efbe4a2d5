#include "scene/statistics.h"

#include <algorithm>
#include <functional>
#include <limits>
#include <numbers>

#include "scene/activate.h"
#include "scene/arrays.h"
#include "scene/sh.h"

namespace splat::scene {
namespace {

constexpr double kLeastScale = 1e-12;

class RangeSum {
  public:
    void add(double value) {
        if (!std::isfinite(value)) {
            ++range_.non_finite;
            return;
        }
        range_.min = range_.finite == 0 ? value : std::min(range_.min, value);
        range_.max = range_.finite == 0 ? value : std::max(range_.max, value);
        sum_ += value;
        ++range_.finite;
    }
    [[nodiscard]] Range range() const {
        Range range = range_;
        if (range.finite > 0) range.mean = sum_ / static_cast<double>(range.finite);
        return range;
    }

  private:
    Range range_;
    double sum_ = 0;
};

template <class Map>
Range range_of(const std::vector<float>& values, const Map& map) {
    RangeSum sum;
    for (const float value : values) sum.add(map(static_cast<double>(value)));
    return sum.range();
}

/// The value of a rank, from 0, in a list, which is reordered.
double at_rank(std::vector<double>& values, std::size_t rank) {
    std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(rank),
                     values.end());
    return values[rank];
}

/// The quantile of a list, which is reordered. One number per Gaussian is all that a measurement takes besides the
/// scene.
double quantile(std::vector<double>& values, double part) {
    if (values.empty()) return 0;
    return at_rank(values, static_cast<std::size_t>(part * static_cast<double>(values.size() - 1)));
}

/// The area of the 1-sigma ellipse over the two largest scales; infinite or NaN where these are.
double footprint(const float* log_scales) {
    double most = -std::numeric_limits<double>::infinity();
    for (std::size_t k = 0; k < 3; ++k) {
        const auto a = static_cast<double>(log_scales[k]);
        const auto b = static_cast<double>(log_scales[(k + 1) % 3]);
        if (std::isnan(a)) return a;
        most = std::fmax(most, a + b);  // NaN of opposite infinities, which is no largest one
    }
    return std::numbers::pi * std::exp(most);
}

/// extent  sides of the box that holds 98 % of the means along each axis
double fill_ratio(const Gaussians& g, const Vec3& extent) {
    const auto add_areas = [&g](auto&& take) {
        for (std::size_t i = 0; i < g.count(); ++i) {
            const double area = footprint(&g.log_scales[3 * i]);
            if (!std::isnan(area)) take(area);
        }
    };
    double sum = 0;
    add_areas([&sum](double area) { sum += area; });
    double face = (extent.x * extent.y + extent.y * extent.z + extent.z * extent.x) / 3;
    if (!(face > 0)) {
        std::vector<double> areas;
        add_areas([&areas](double area) { areas.push_back(area); });
        face = quantile(areas, 0.5);
    }
    if (sum == 0 || std::isinf(sum)) return sum;
    return sum / face;
}

void measure_places(const Gaussians& g, Statistics& s) {
    std::vector<double> values;
    values.reserve(g.count());
    const auto collect = [&](const auto& value) {
        values.clear();
        for (std::size_t i = 0; i < g.count(); ++i) {
            const Vec3 mean = glm::make_vec3(&g.means[i * 3]);
            if (is_finite(mean)) values.push_back(value(mean));
        }
    };
    Vec3 extent;
    for (std::size_t k = 0; k < 3; ++k) {
        collect([k](const Vec3& mean) { return mean[k]; });
        if (values.empty()) return;
        const auto [low, high] = std::ranges::minmax_element(values);
        s.bounds.low[k] = *low;
        s.bounds.high[k] = *high;
        s.center[k] = quantile(values, 0.5);
        const auto one_percent =
            static_cast<std::size_t>(std::lround(0.01 * static_cast<double>(values.size() - 1)));
        const double first = at_rank(values, one_percent);
        extent[k] = at_rank(values, values.size() - 1 - one_percent) - first;
    }
    s.fill_ratio = fill_ratio(g, extent);
    collect([&s](const Vec3& mean) { return glm::length(mean - s.center); });
    s.radius = quantile(values, 0.95);
}

void measure_colors(const Gaussians& g, Statistics& s) {
    const std::size_t each = std::size_t{sh_coefficients(g.sh_degree)} * 3;
    RangeSum colors;
    RangeSum bands;
    for (std::size_t i = 0; i < g.sh.size(); ++i)
        if (i % each < 3)
            colors.add(0.5 + kSh0 * static_cast<double>(g.sh[i]));
        else
            bands.add(static_cast<double>(g.sh[i]));
    s.colors = colors.range();
    s.bands = bands.range();
}

void count_defects(const Gaussians& g, Statistics& s) {
    for (std::size_t i = 0; i < g.count(); ++i) {
        const double length = length_of(rotation_at(g, i));
        if (!std::isfinite(length) || length == 0) ++s.bad_rotations;
        const float* const sizes = &g.log_scales[i * 3];
        if (std::any_of(sizes, sizes + 3, [](float size) {
                return std::exp(static_cast<double>(size)) < kLeastScale;
            }))
            ++s.degenerate;
        if (opacity_of(static_cast<double>(g.opacity_logits[i])) < kLeastOpacity) ++s.invisible;
    }
    for (const Attribute& attribute : attributes(g.sh_degree)) {
        const std::vector<float>& values = g.*attribute.array;
        for (const float value : values) s.non_finite += std::isfinite(value) ? 0U : 1U;
        s.bytes += values.size() * sizeof(float);
    }
}

}  // namespace

Result<Statistics> statistics(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    Statistics s;
    s.count = g.count();
    s.sh_degree = g.sh_degree;
    s.means = range_of(g.means, [](double value) { return value; });
    s.scales = range_of(g.log_scales, [](double value) { return std::exp(value); });
    s.opacities = range_of(g.opacity_logits, opacity_of);
    measure_places(g, s);
    measure_colors(g, s);
    count_defects(g, s);
    return s;
}

}  // namespace splat::scene
