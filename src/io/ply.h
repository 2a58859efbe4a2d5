#pragma once

#include "io/scene_load.h"

namespace splat::io {

/// The file starts with the header of a .ply that is not compressed. Errors: as parse_ply_header().
Result<bool> is_plain_ply(Bytes file);

/// Gaussians of a 3DGS .ply file: ascii or binary of either byte order, properties in any order and
/// of any scalar type. Needed of element "vertex": x y z f_dc_0..2 opacity scale_0..2 rot_0..3;
/// f_rest_0 .. f_rest_{3 (d+1)^2 - 4}, all red ones first, give the degree d. Normals are
/// ignored, and so is any other property or element, which the report names. Bands above kMaxShDegree
/// are dropped and reported.
///
/// Errors       kFormat with line, byte or property; kUnsupported for a count above the limit
/// Precision    exact: float32 values keep their bits, except rotations that are not of length 1
/// Source       Kerbl et al. 2023: the files of the authors' program
Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options = {});

/// binary_little_endian, all float, in the order x y z nx ny nz f_dc_0.. f_rest_0.. opacity
/// scale_0.. rot_0.. that 3DGS viewers expect; normals are 0. Errors: as prepare_save().
Result<Buffer> write_ply(const scene::Gaussians& gaussians, const SaveOptions& options = {});

}  // namespace splat::io
