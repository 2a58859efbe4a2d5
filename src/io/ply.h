#pragma once

#include "io/scene_load.h"

namespace splat::io {

/// Gaussians of a 3DGS .ply file: ascii or binary of either byte order, properties in any order and
/// of any scalar type. Needed of element "vertex": x y z f_dc_0..2 opacity scale_0..2 rot_0..3;
/// f_rest_0 .. f_rest_{3 (d+1)^2 - 4}, all red ones first, give the degree d. Normals are passed
/// over; any other property or element too, and is named in the report. Bands above kMaxShDegree
/// are dropped and reported.
///
/// Errors       kInvalidArgument with line, byte or property; kUnsupported for a count above the limit
/// Precision    exact: float32 values keep their bits, but for rotations that are not of length 1
/// Source       Kerbl et al. 2023, the files that the authors' program writes
Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options = {});

/// binary_little_endian, all float, in the order x y z nx ny nz f_dc_0.. f_rest_0.. opacity
/// scale_0.. rot_0.. that 3DGS viewers expect; normals are 0. Errors: as prepare_save().
Result<Buffer> write_ply(const scene::Gaussians& gaussians, const SaveOptions& options = {});

}  // namespace splat::io
