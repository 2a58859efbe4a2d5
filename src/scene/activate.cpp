#include "scene/activate.h"

#include <algorithm>
#include <cmath>
#include <limits>

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

}  // namespace splat::scene
