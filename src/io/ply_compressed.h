#pragma once

#include "io/ply_header.h"
#include "io/scene_load.h"

namespace splat::io {

/// A compressed .ply has elements "chunk" and "vertex", the latter with "packed_position".
bool has_packed_chunks(const PlyHeader& header);

/// The file starts with the header of a compressed .ply. Errors: as parse_ply_header().
Result<bool> is_compressed_ply(Bytes file);

/// A compressed .ply file as SuperSplat and splat-transform write it: chunks of 256 Gaussians with
/// the ranges of position, log scale and (if present) colour, one 32-bit word for each attribute of
/// a Gaussian, and an optional element "sh" with bands in bytes.
///
/// Errors       as read_ply(); kFormat if there are fewer chunks than the Gaussians need
/// Precision    of the format: position 1/2046 of the range of the chunk (y: 1/1022), log scale the
///              same, rotation 0.7/1023 per component, opacity and colour 1/510, bands 1/64
/// Source       PlayCanvas, "compressed PLY" of playcanvas/splat-transform
Result<LoadedScene> read_compressed_ply(Bytes file, const LoadOptions& options = {});

}  // namespace splat::io
