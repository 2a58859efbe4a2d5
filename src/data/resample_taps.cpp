#include "data/resample_taps.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splat::data {
namespace {

double sinc(double x) {
    return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

double pillow_kernel(Filter filter, double x) {
    constexpr double a = -0.5;
    const double d = std::abs(x);
    switch (filter) {
        case Filter::kBox:
            return x > -0.5 && x <= 0.5 ? 1 : 0;
        case Filter::kBilinear:
            return d < 1 ? 1 - d : 0;
        case Filter::kBicubic:
            if (d < 1) return ((a + 2) * d - (a + 3)) * d * d + 1;
            return d < 2 ? (((d - 5) * d + 8) * d - 4) * a : 0;
        case Filter::kLanczos:
            break;
    }
    return x >= -3 && x < 3 ? sinc(x) * sinc(x / 3) : 0;
}

double support_of(Filter filter) {
    constexpr double kSupports[] = {0.5, 1, 2, 3};
    return kSupports[static_cast<std::size_t>(filter)];
}

}  // namespace

std::vector<Taps> pillow_taps(std::uint32_t from, std::uint32_t to, Filter filter) {
    const double scale = static_cast<double>(from) / to;
    const double widened = std::max(scale, 1.0);
    const double support = support_of(filter) * widened;
    std::vector<Taps> all(to);
    for (std::uint32_t i = 0; i < to; ++i) {
        const double center = (i + 0.5) * scale;
        const auto first = static_cast<std::size_t>(std::max(0.0, center - support + 0.5));
        const auto end =
            std::min<std::size_t>(from, static_cast<std::size_t>(center + support + 0.5));
        all[i].first = first;
        double sum = 0;
        for (std::size_t k = first; k < end; ++k) {
            all[i].weights.push_back(
                pillow_kernel(filter, (static_cast<double>(k) - center + 0.5) * (1 / widened)));
            sum += all[i].weights.back();
        }
        if (sum == 0) continue;
        for (double& weight : all[i].weights) weight *= 1 / sum;
    }
    return all;
}

}  // namespace splat::data
