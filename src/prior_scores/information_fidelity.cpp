#include "prior_scores/information_fidelity.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "prior_scores/check_map.h"

namespace splat::prior_scores {
namespace {

constexpr double kNoise = 2;     ///< variance of the visual noise
constexpr double kTiny = 1e-10;  ///< smaller variances count as none

struct Plane {
    std::size_t height = 0, width = 0;
    std::vector<double> values;
};

std::vector<double> gaussian_window(std::size_t size) {
    std::vector<double> window(size);
    double sum = 0;
    for (std::size_t i = 0; i < size; ++i) {
        const double x = (static_cast<double>(i) - static_cast<double>(size / 2)) /
                         (static_cast<double>(size) / 5);
        sum += window[i] = std::exp(-x * x / 2);
    }
    for (double& weight : window) weight /= sum;
    return window;
}

/// The window along both axes, inside of the plane only.
Plane filtered(const Plane& plane, const std::vector<double>& window) {
    const std::size_t n = window.size();
    const Plane shape{plane.height - n + 1, plane.width - n + 1, {}};
    std::vector<double> rows(plane.height * shape.width);
    for (std::size_t y = 0; y < plane.height; ++y)
        for (std::size_t x = 0; x < shape.width; ++x)
            for (std::size_t i = 0; i < n; ++i)
                rows[y * shape.width + x] += window[i] * plane.values[y * plane.width + x + i];
    Plane out = shape;
    out.values.resize(shape.height * shape.width);
    for (std::size_t y = 0; y < shape.height; ++y)
        for (std::size_t i = 0; i < n; ++i)
            for (std::size_t x = 0; x < shape.width; ++x)
                out.values[y * shape.width + x] += window[i] * rows[(y + i) * shape.width + x];
    return out;
}

Plane every_other(const Plane& plane) {
    Plane out{(plane.height + 1) / 2, (plane.width + 1) / 2, {}};
    for (std::size_t y = 0; y < plane.height; y += 2)
        for (std::size_t x = 0; x < plane.width; x += 2)
            out.values.push_back(plane.values[y * plane.width + x]);
    return out;
}

Plane product(const Plane& a, const Plane& b) {
    Plane out = a;
    for (std::size_t i = 0; i < out.values.size(); ++i) out.values[i] *= b.values[i];
    return out;
}

/// Both sums of the definition, at one scale.
void add_scale(const Plane& p, const Plane& t, const std::vector<double>& window, double& kept,
               double& whole) {
    const Plane mp = filtered(p, window), mt = filtered(t, window);
    const Plane pp = filtered(product(p, p), window), tt = filtered(product(t, t), window);
    const Plane pt = filtered(product(p, t), window);
    for (std::size_t i = 0; i < mp.values.size(); ++i) {
        double s_t = std::max(0.0, tt.values[i] - mt.values[i] * mt.values[i]);
        const double s_p = std::max(0.0, pp.values[i] - mp.values[i] * mp.values[i]);
        const double s_pt = pt.values[i] - mp.values[i] * mt.values[i];
        double gain = s_pt / (s_t + kTiny);
        double rest = s_p - gain * s_pt;
        if (s_t < kTiny) {
            gain = 0;
            rest = s_p;
            s_t = 0;
        }
        if (s_p < kTiny) gain = rest = 0;
        if (gain < 0) {
            gain = 0;
            rest = s_p;
        }
        kept += std::log10(1 + gain * gain * s_t / (std::max(rest, kTiny) + kNoise));
        whole += std::log10(1 + s_t / kNoise);
    }
}

/// NaN if the truth has no variance anywhere.
double channel_fidelity(Plane p, Plane t) {
    double kept = 0, whole = 0;
    for (const std::size_t size : {17U, 9U, 5U, 3U}) {
        const std::vector<double> window = gaussian_window(size);
        if (size != 17) {
            p = every_other(filtered(p, window));
            t = every_other(filtered(t, window));
        }
        add_scale(p, t, window, kept, whole);
    }
    return whole > 0 ? kept / whole : std::numeric_limits<double>::quiet_NaN();
}

Plane plane_of(std::span<const float> map, std::size_t height, std::size_t width, double range) {
    Plane plane{height, width, {}};
    for (const float value : map) plane.values.push_back(range * static_cast<double>(value));
    return plane;
}

bool is_constant(std::span<const float> map) {
    return std::ranges::all_of(map, [&](float value) { return value == map[0]; });
}

}  // namespace

Result<FidelityScores> information_fidelity(std::span<const float> prediction,
                                            std::span<const float> truth, std::uint32_t channels,
                                            std::uint32_t height, std::uint32_t width,
                                            const FidelityOptions& options) {
    if (height < kLeastFidelitySide || width < kLeastFidelitySide)
        return error(Code::kShape, "images of %u x %u pixels, expected at least %u x %u", width,
                     height, kLeastFidelitySide, kLeastFidelitySide);
    const std::size_t pixels = std::size_t{height} * width;
    SPLAT_TRY(check_map(prediction, pixels * channels, "the prediction"));
    SPLAT_TRY(check_map(truth, pixels * channels, "the truth"));
    const bool has_alpha = channels == 2 || channels == 4;
    const std::uint32_t counted = has_alpha && !options.alpha_counts ? channels - 1 : channels;
    FidelityScores scores;
    double sum = 0;
    for (std::uint32_t c = 0; c < counted; ++c) {
        const auto p = prediction.subspan(c * pixels, pixels);
        const auto t = truth.subspan(c * pixels, pixels);
        const bool is_alpha = has_alpha && c + 1 == channels;
        double vif = std::numeric_limits<double>::quiet_NaN();
        if (is_alpha && is_constant(p) && is_constant(t) && p[0] == t[0])
            vif = 1;
        else if (!is_constant(t))
            vif = channel_fidelity(plane_of(p, height, width, options.range),
                                   plane_of(t, height, width, options.range));
        scores.channels.push_back(vif);
        if (std::isnan(vif))
            ++scores.constant;
        else
            sum += vif;
    }
    scores.vif = scores.constant == counted ? std::numeric_limits<double>::quiet_NaN()
                                            : sum / (counted - scores.constant);
    return scores;
}

}  // namespace splat::prior_scores
