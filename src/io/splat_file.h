#pragma once

#include "io/scene_load.h"

namespace splat::io {

/// A .splat file: 32 bytes for each Gaussian, no header and no spherical harmonics. Position and
/// linear scale as 6 x float32, then 8 bytes: R G B opacity / 255, and w x y z = (byte - 128) / 128.
/// The usual frame is that of .ply. Opacities 0 and 1 become logits of -/+ kMaxOpacityLogit.
///
/// Errors       kFormat if the length is not a multiple of 32; kUnsupported above the limit
/// Source       antimatter15/splat, whose README describes the layout
Result<LoadedScene> read_splat(Bytes file, const LoadOptions& options = {});

/// Bands above 0 are lost. Colours outside [0, 1] are clamped. Within half a step of 1/255 (colour,
/// opacity) and 1/128 (components of the rotation); positions exactly, scales to float32 rounding of
/// exp. Errors: as prepare_save(); kInvalidArgument if a rotation, opacity or colour is not finite, or a
/// finite log scale has no exponential in float32.
Result<Buffer> write_splat(const scene::Gaussians& gaussians, const SaveOptions& options = {});

}  // namespace splat::io
