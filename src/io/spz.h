#pragma once

#include "io/scene_load.h"

namespace splat::io {

/// Axes of a .spz file, unless options name others.
inline constexpr scene::Frame kSpzFrame = scene::Frame::kRub;

/// The file starts with the mark of gzip or of .spz.
Result<bool> is_spz(Bytes file);

/// A .spz file of version 1 to 4: gzip of header and arrays (1 to 3; also without the gzip), or a
/// header with a table of zstd streams (4). Bands above kMaxShDegree and
/// extensions are skipped and reported.
///
/// Errors       kFormat if damaged, truncated, or longer than the header says, unless lenient;
///              kUnsupported for other versions, for extensions before version 4, and above the limit
/// Source       nianticlabs/spz, whose README and loader describe the layout
Result<LoadedScene> read_spz(Bytes file, const LoadOptions& options = {});

/// Version 3, or 4 by the options (smaller files, which fewer programs read).
///
/// Errors       as prepare_save(); kInvalidArgument if a value is not finite, or a mean beyond +-2^23
///              units; kUnsupported for other versions
/// Precision    half a step of: mean 2^-12 units (coarser if a mean is beyond 2048), log scale 1/16,
///              opacity 1/255, colour 1/255/0.15, band 1 1/16, bands 2 and 3 1/8; rotation within
///              0.005 radians. Clamped: log scale to [-10, 5.94], band 0 to +-3.33, others to [-1, 1)
Result<Buffer> write_spz(const scene::Gaussians& gaussians, const SaveOptions& options = {});

}  // namespace splat::io
