#include "scene/statistics.h"

#include <algorithm>
#include <functional>

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

Range range_of(const std::vector<float>& values, const std::function<double(double)>& map) {
    RangeSum sum;
    for (const float value : values) sum.add(map(static_cast<double>(value)));
    return sum.range();
}

/// The quantile of a list, which is reordered.
double quantile(std::vector<double>& values, double part) {
    if (values.empty()) return 0;
    const auto place = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), values.begin() + place, values.end());
    return values[static_cast<std::size_t>(place)];
}

void measure_places(const Gaussians& g, Statistics& s) {
    const std::vector<Vec3> places = finite_means(g);
    if (places.empty()) return;
    std::vector<double> values(places.size());
    s.bounds = bounds_of(places);
    for (std::size_t k = 0; k < 3; ++k) {
        for (std::size_t i = 0; i < places.size(); ++i) values[i] = places[i][k];
        s.center[k] = quantile(values, 0.5);
    }
    for (std::size_t i = 0; i < places.size(); ++i) values[i] = glm::length(places[i] - s.center);
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
    for (const Attribute& attribute : attributes(g.sh_degree))
        for (const float value : g.*attribute.array) s.non_finite += std::isfinite(value) ? 0U : 1U;
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
