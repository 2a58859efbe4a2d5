#include "scene/activate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "scene/arrays.h"

namespace splat::scene {

double opacity_of(double logit) {
    if (logit >= 0) return 1 / (1 + std::exp(-logit));
    const double e = std::exp(logit);
    return e / (1 + e);
}

double logit_of(double opacity) {
    if (!(opacity >= 0 && opacity <= 1)) return std::numeric_limits<double>::quiet_NaN();
    const double logit = std::log(opacity) - std::log1p(-opacity);
    return std::clamp(logit, -kMaxOpacityLogit, kMaxOpacityLogit);
}

Result<ActivatedGaussians> activate(const Gaussians& g) {
    SPLAT_TRY(check_arrays(g));
    ActivatedGaussians result{g.sh_degree, g.means, {}, g.rotations, {}, g.sh};
    result.scales.reserve(g.log_scales.size());
    for (const float value : g.log_scales)
        result.scales.push_back(static_cast<float>(std::exp(static_cast<double>(value))));
    result.opacities.reserve(g.count());
    for (const float value : g.opacity_logits)
        result.opacities.push_back(static_cast<float>(opacity_of(static_cast<double>(value))));
    return result;
}

Result<Gaussians> deactivate(const ActivatedGaussians& a) {
    Gaussians result{a.sh_degree, a.means, {}, a.rotations, {}, a.sh};
    for (std::size_t i = 0; i < a.scales.size(); ++i) {
        const auto value = static_cast<double>(a.scales[i]);
        if (!(value > 0))
            return error(Code::kInvalidArgument,
                         "gaussians: scale %zu of Gaussian %zu is %g, expected > 0", i % 3, i / 3,
                         value);
        result.log_scales.push_back(static_cast<float>(std::log(value)));
    }
    for (std::size_t i = 0; i < a.opacities.size(); ++i) {
        const auto value = static_cast<double>(a.opacities[i]);
        if (!(value >= 0 && value <= 1))
            return error(Code::kInvalidArgument,
                         "gaussians: opacity of Gaussian %zu is %g, expected 0 to 1", i, value);
        result.opacity_logits.push_back(static_cast<float>(logit_of(value)));
    }
    SPLAT_TRY(check_arrays(result));
    return result;
}

}  // namespace splat::scene
