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
