#pragma once

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

}  // namespace splat::scene
