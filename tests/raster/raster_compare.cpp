#include "raster/raster_compare.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <span>

namespace splat::test {
namespace {

using testing::AssertionFailure;
using testing::AssertionResult;
using testing::AssertionSuccess;

constexpr double kNeedleRatio = 1000;

double largest(std::span<const double> values) {
    double most = 0;
    for (const double value : values) most = std::max(most, std::abs(value));
    return most;
}

bool is_float64(RasterJudge judge) {
    return judge == RasterJudge::kFloat64 || judge == RasterJudge::kFloat64Needles;
}

/// In 3dgs an invisible Gaussian with an opacity below kAlphaMin has a radius.
bool is_unseen(float opacity) {
    return opacity > 0 && opacity < raster::kAlphaMin;
}

/// Runs over the tensors of one comparison and stops at the first that differs.
class Comparison {
  public:
    Comparison(const RasterSubject& subject, std::size_t count)
        : subject_(subject), count_(count) {}

    /// Per-pixel numbers.
    void image(const char* name, const std::vector<double>& got,
               const std::vector<double>& expected) {
        if (!begins(name, got.size(), expected.size())) return;
        const std::size_t pixels = subject_.fragile.size();
        if (pixels == 0 || expected.size() % pixels != 0)
            return refuse(name, "no mask of its size");
        const std::size_t channels = expected.size() / pixels;
        const double size = largest(expected);
        const double strict = allowed(name, expected, 0, 1);
        for (std::size_t i = 0; i < got.size(); ++i) {
            const bool loose = subject_.fragile[i / channels] && !is_float64(subject_.judge);
            check(name, i, got[i], expected[i], loose ? kRasterFragile * size : strict);
        }
    }

    /// Depths of one of two Gaussians, where the transmittance between them is next to a half.
    void median(const RasterOutputs& got, const RasterOutputs& expected) {
        const std::vector<double>& late = expected.median;
        if (!begins("median", got.median.size(), late.size())) return;
        const double bound = allowed(subject_.rays ? "median_of_rays" : "median", late, 0, 1);
        for (std::size_t i = 0; i < late.size(); ++i) {
            if (subject_.fragile[i] && !is_float64(subject_.judge)) continue;
            const double early = expected.median_early[i];
            const bool is_early = std::abs(got.median[i] - early) <= bound;
            check("median", i, got.median[i], is_early ? early : late[i], bound);
        }
    }

    /// `width` numbers per Gaussian.
    void projected(const char* name, const std::vector<double>& got,
                   const std::vector<double>& expected) {
        if (!begins(name, got.size(), expected.size())) return;
        const std::size_t width = std::max<std::size_t>(expected.size() / count_, 1);
        for (std::size_t i = 0; i < got.size(); ++i)
            if (!may_be_culled(i / width, got, i / width * width, width))
                check(name, i, got[i], expected[i], allowed(name, expected, i / width, width));
    }

    void gradient(const char* name, const RasterGradients& all_got,
                  const RasterGradients& all_expected,
                  std::vector<double> RasterGradients::*tensor) {
        const std::vector<double>& got = all_got.*tensor;
        const std::vector<double>& expected = all_expected.*tensor;
        if (!begins(name, got.size(), expected.size())) return;
        double bound = allowed("gradient", expected, 0, 1);
        if (subject_.in_float != nullptr) {
            double error = 0;
            for (std::size_t i = 0; i < expected.size(); ++i)
                error = std::max(error, std::abs((subject_.in_float->*tensor)[i] - expected[i]));
            if (std::isfinite(error)) bound = std::max(bound, kRasterOfFloat32 * error);
        }
        const std::size_t width = count_ == 0 ? 0 : expected.size() / count_;
        const bool per_gaussian = width * count_ == expected.size() && width > 0;
        for (std::size_t i = 0; i < got.size(); ++i) {
            const bool spoiled =
                per_gaussian && !subject_.hostile.empty() && subject_.hostile[i / width];
            check(name, i, got[i], spoiled ? 0 : expected[i], spoiled ? 0 : bound);
        }
    }

    void integers(const char* name, const std::vector<std::int64_t>& got,
                  const std::vector<std::int64_t>& expected, bool per_pixel) {
        if (!begins(name, got.size(), expected.size())) return;
        const std::size_t width = count_ == 0 ? 1 : std::max<std::size_t>(got.size() / count_, 1);
        const bool rounded = std::string(name) == "radii" && !is_float64(subject_.judge);
        for (std::size_t i = 0; i < got.size(); ++i) {
            if (per_pixel && subject_.fragile[i] && !is_float64(subject_.judge)) continue;
            if (!per_pixel && got[i] == 0 && is_faint(i / width)) continue;
            // A ceil() of a number next to an integer.
            const bool off_by_one = rounded && got[i] != 0 && expected[i] != 0;
            const auto radius = static_cast<double>(expected[i]);
            // Where the near plane cuts little off an ellipsoid, the end of its box cancels; kRayMargin holds it.
            const double cut = subject_.rays ? 1e-3 * radius : 0;
            check(name, i, static_cast<double>(got[i]), radius, off_by_one ? 1 + cut : 0);
        }
    }

    AssertionResult result() {
        if (!failure_.empty()) return AssertionFailure() << subject_.what << ": " << failure_;
        if (compared_ == 0)
            return AssertionFailure() << subject_.what << ": mistrusted, nothing was compared";
        return AssertionSuccess();
    }

  private:
    /// False if there is nothing to do; sizes that differ are a failure.
    bool begins(const char* name, std::size_t got, std::size_t expected) {
        if (got == 0 || expected == 0 || !failure_.empty()) return false;
        ++compared_;
        if (got == expected) return true;
        refuse(name, std::to_string(got) + " elements, expected " + std::to_string(expected));
        return false;
    }

    double allowed(const char* name, const std::vector<double>& expected, std::size_t row,
                   std::size_t width) const {
        if (subject_.judge == RasterJudge::kFloat64) return kRasterFloat64 * largest(expected);
        if (is_float64(subject_.judge)) return kRasterFloat64Needles * largest(expected);
        const RasterTolerance& tolerance = raster_tolerance(name);
        const bool needles = subject_.judge == RasterJudge::kFloat32Needles;
        const double figure = needles ? tolerance.needles : tolerance.usual;
        if (tolerance.scale == RasterScale::kAbsolute) return figure;
        if (tolerance.scale == RasterScale::kOfLargest) return figure * largest(expected);
        return figure * std::max(1.0, largest(std::span(expected).subspan(row * width, width)));
    }

    /// A kernel may cull invisible Gaussians.
    [[nodiscard]] bool is_faint(std::size_t i) const {
        return !is_float64(subject_.judge) && i < subject_.opacities.size() &&
               is_unseen(subject_.opacities[i]);
    }

    [[nodiscard]] bool may_be_culled(std::size_t i, const std::vector<double>& got,
                                     std::size_t first, std::size_t width) const {
        return is_faint(i) && largest(std::span(got).subspan(first, width)) == 0;
    }

    void check(const char* name, std::size_t i, double got, double expected, double bound) {
        if (std::abs(got - expected) <= bound || !failure_.empty()) return;
        char text[256];
        std::snprintf(text, sizeof text, "[%zu] = %.9g, expected %.17g: off by %.3g, bound %.3g", i,
                      got, expected, std::abs(got - expected), bound);
        refuse(name, text);
    }

    void refuse(const char* name, const std::string& why) {
        if (failure_.empty()) failure_ = std::string(name) + ": " + why;
    }

    const RasterSubject& subject_;
    std::size_t count_;
    std::size_t compared_ = 0;
    std::string failure_;
};

}  // namespace

AssertionResult outputs_match(const RasterOutputs& got, const RasterOutputs& expected,
                              const RasterSubject& subject) {
    Comparison compare(subject, subject.opacities.size());
    compare.projected("means2d", got.means2d, expected.means2d);
    compare.projected("conics", got.conics, expected.conics);
    compare.projected("depths", got.depths, expected.depths);
    compare.projected("colors", got.colors, expected.colors);
    compare.projected("compensations", got.compensations, expected.compensations);
    compare.integers("radii", got.radii, expected.radii, false);
    compare.integers("valid", got.valid, expected.valid, false);
    if (is_float64(subject.judge)) compare.integers("order", got.order, expected.order, false);
    compare.integers("tiles_rect", got.tiles_rect, expected.tiles_rect, false);
    compare.integers("tiles_exact", got.tiles_exact, expected.tiles_exact, false);
    compare.integers("pixels_visible", got.pixels_visible, expected.pixels_visible, false);
    compare.image("rgb", got.rgb, expected.rgb);
    compare.image("alpha", got.alpha, expected.alpha);
    compare.image("depth", got.depth, expected.depth);
    compare.image("depth_expected", got.depth_expected, expected.depth_expected);
    compare.median(got, expected);
    compare.image("normal", got.normal, expected.normal);
    compare.integers("n_contrib", got.n_contrib, expected.n_contrib, true);
    for (std::size_t i = 0; i < subject.hostile.size() && !got.radii.empty(); ++i)
        if (subject.hostile[i] && !is_unseen(subject.opacities[i]) &&
            (got.radii[2 * i] != 0 || got.radii[2 * i + 1] != 0))
            return AssertionFailure() << subject.what << ": radius of the hostile Gaussian " << i;
    return compare.result();
}

AssertionResult gradients_match(const RasterGradients& got, const RasterGradients& expected,
                                const RasterSubject& subject) {
    Comparison compare(subject, subject.opacities.size());
    compare.gradient("grad_means", got, expected, &RasterGradients::means);
    compare.gradient("grad_scales", got, expected, &RasterGradients::scales);
    compare.gradient("grad_rotations", got, expected, &RasterGradients::rotations);
    compare.gradient("grad_opacities", got, expected, &RasterGradients::opacities);
    compare.gradient("grad_sh", got, expected, &RasterGradients::sh);
    compare.gradient("grad_colors", got, expected, &RasterGradients::colors);
    compare.gradient("grad_means2d", got, expected, &RasterGradients::means2d);
    compare.gradient("grad_means2d_abs", got, expected, &RasterGradients::means2d_abs);
    compare.gradient("grad_conics", got, expected, &RasterGradients::conics);
    compare.gradient("grad_world_to_camera", got, expected, &RasterGradients::world_to_camera);
    compare.gradient("grad_twist", got, expected, &RasterGradients::twist);
    compare.gradient("grad_intrinsics", got, expected, &RasterGradients::intrinsics);
    return compare.result();
}

bool has_needles(const RasterCase& scene) {
    for (std::size_t i = 0; i < scene.count(); ++i) {
        const float* scale = &scene.scales[3 * i];
        const auto [least, most] = std::minmax({scale[0], scale[1], scale[2]});
        if (least > 0 && std::isfinite(most) &&
            static_cast<double>(most) >= kNeedleRatio * static_cast<double>(least))
            return true;
    }
    return false;
}

}  // namespace splat::test
