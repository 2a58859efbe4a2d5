#pragma once

#include "core/status.h"
#include "scene/gaussians.h"

namespace splat::scene {

/// Opacities beyond 1 / (1 + exp(-/+40)) get this logit, so that gradients and files stay finite; in
/// float32 sigmoid(40) is 1.
inline constexpr double kMaxOpacityLogit = 40;

/// Gaussians of an opacity below this are never drawn: they do not show in 8 bits.
inline constexpr double kLeastOpacity = 1.0 / 255;

/// 1 / (1 + exp(-logit)), without overflow.
double opacity_of(double logit);

/// log(p / (1 - p)), clamped to -/+ kMaxOpacityLogit; NaN outside [0, 1].
double logit_of(double opacity);

/// Gaussians in the parameters of a rasterizer.
struct ActivatedGaussians {
    std::uint32_t sh_degree = 0;
    std::vector<float> means;      ///< [n,3]
    std::vector<float> scales;     ///< [n,3] standard deviations
    std::vector<float> rotations;  ///< [n,4] w, x, y, z; of length 1
    std::vector<float> opacities;  ///< [n] 0 to 1
    std::vector<float> sh;         ///< [n,(sh_degree+1)^2,3]
};

/// scale = exp(log_scale), opacity = 1 / (1 + exp(-logit)); the rest is copied.
///
/// Errors       as check_arrays()
/// Precision    computed in float64, rounded once
Result<ActivatedGaussians> activate(const Gaussians& gaussians);

/// The inverse: log_scale = log(scale), logit = log(p / (1 - p)) within -/+ kMaxOpacityLogit.
///
/// Errors       kInvalidArgument if a scale is not > 0 or an opacity not in [0, 1] (NaN included), or
///              an array does not fit; names the Gaussian
/// Precision    as activate()
Result<Gaussians> deactivate(const ActivatedGaussians& activated);

}  // namespace splat::scene
