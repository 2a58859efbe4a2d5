#include "eval/ledger.h"

#include <algorithm>
#include <cmath>

#include "scene/activate.h"

namespace splat::eval {
namespace {

/// An opacity below this does not show in 8 bits.
constexpr double kLeastOpacity = 1.0 / 255;

bool finite_row(const std::vector<float>& values, std::size_t row, std::size_t count) {
    const std::size_t each = values.size() / count;
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(row * each);
    return std::all_of(first, first + static_cast<std::ptrdiff_t>(each),
                       [](float value) { return std::isfinite(value); });
}

}  // namespace

void Ledger::add(const Ledger& other) {
    outputs_not_finite += other.outputs_not_finite;
    gaussians += other.gaussians;
    gaussians_not_finite += other.gaussians_not_finite;
    invisible += other.invisible;
    visible += other.visible;
    images_not_finite += other.images_not_finite;
    images_blank += other.images_blank;
}

std::uint64_t count_not_finite(std::span<const float> values) {
    return static_cast<std::uint64_t>(std::count_if(
        values.begin(), values.end(), [](float value) { return !std::isfinite(value); }));
}

void count_gaussians(const scene::Gaussians& predicted, Ledger& ledger) {
    const std::size_t count = predicted.count();
    ledger.gaussians += count;
    for (std::size_t i = 0; i < count; ++i) {
        const bool finite =
            finite_row(predicted.means, i, count) && finite_row(predicted.log_scales, i, count) &&
            finite_row(predicted.rotations, i, count) &&
            finite_row(predicted.opacity_logits, i, count) && finite_row(predicted.sh, i, count);
        const auto logit = static_cast<double>(predicted.opacity_logits[i]);
        if (!finite)
            ++ledger.gaussians_not_finite;
        else if (scene::opacity_of(logit) < kLeastOpacity)
            ++ledger.invisible;
        else
            ++ledger.visible;
    }
}

bool is_plain(std::span<const float> image, const std::array<float, 3>& colour) {
    const std::size_t pixels = image.size() / 3;
    for (std::size_t channel = 0; channel < 3; ++channel)
        for (const float value : image.subspan(channel * pixels, pixels))
            if (value != colour[channel]) return false;
    return true;
}

}  // namespace splat::eval
