#pragma once

#include "io/scene_load.h"

namespace splat::io {

struct PlyHeader;

/// What a writer puts, as SceneFormat::write, in memory.
template <class Writer>
Result<Buffer> in_memory(const Writer& write, const scene::Gaussians& gaussians,
                         const SaveOptions& options) {
    BufferSink file;
    SPLAT_TRY(write(gaussians, options, file));
    return std::move(file.file);
}

/// The file starts with the header of a .ply that is not compressed. Errors: as parse_ply_header().
Result<bool> is_plain_ply(Bytes file);

/// Gaussians of a 3DGS .ply file: ascii or binary of either byte order, properties in any order and
/// of any scalar type. Needed of element "vertex": x y z f_dc_0..2 opacity scale_0..2 rot_0..3;
/// f_rest_0 .. f_rest_{3 (d+1)^2 - 4}, all red ones first, give the degree d. Normals are
/// ignored, and so is any other property or element, which the report names. Bands above kMaxShDegree
/// are dropped and reported. What is read beside that: antialiased_ply(), and element "color_space" of SHARP, whose one
/// number is 1 for linear colours and 0 for those of sRGB.
///
/// Errors       kFormat with line, byte or property; kUnsupported for a count above the limit
/// Precision    exact: float32 values keep their bits, except rotations that are not of length 1
/// Source       Kerbl et al. 2023: the files of the authors' program; apple/ml-sharp
Result<LoadedScene> read_ply(Bytes file, const LoadOptions& options = {});

/// binary_little_endian, all float, in the order x y z nx ny nz f_dc_0.. f_rest_0.. opacity
/// scale_0.. rot_0.. that 3DGS viewers expect; normals are 0. For antialiased scenes the comment kAntialiasedPly, for
/// linear colours SHARP's element "color_space" behind the vertices. Errors: as prepare_save().
Status put_ply(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
inline Result<Buffer> write_ply(const scene::Gaussians& gaussians,
                                const SaveOptions& options = {}) {
    return in_memory(put_ply, gaussians, options);
}

/// The comment that .ply files of antialiased scenes get, plain and compressed: Brush's, which splat-transform writes
/// too.
inline constexpr const char* kAntialiasedPly = "comment SplatRenderMode: mip\n";

/// Comments of a header that say how its Gaussians are drawn: "SplatRenderMode: default" or "mip" of Brush,
/// "antialiased 0" or "1" of Postshot; the last one counts. Another mode is reported, and warned of if it is 2dgs.
bool antialiased_ply(const PlyHeader& header, LoadReport& report);

/// The file starts with the header of a compressed .ply. Errors: as parse_ply_header().
Result<bool> is_compressed_ply(Bytes file);

/// A compressed .ply file as SuperSplat and splat-transform write it, under any name: chunks of 256 Gaussians with
/// the ranges of position, log scale and (if present) colour, one 32-bit word for each attribute of
/// a Gaussian, and an optional element "sh" with bands in bytes.
///
/// Errors       as read_ply(); kFormat if there are fewer chunks than the Gaussians need
/// Precision    of the format: position 1/2046 of the range of the chunk (y: 1/1022), log scale the
///              same, rotation 0.7/1023 per component, opacity and colour 1/510, bands 1/64
/// Source       PlayCanvas, "compressed PLY" of playcanvas/splat-transform
Result<LoadedScene> read_compressed_ply(Bytes file, const LoadOptions& options = {});

/// The same format, along a Morton curve, so that chunks are small.
///
/// Errors       as prepare_save(); kInvalidArgument if a value is not finite
/// Precision    half a step of: mean and log scale 1/2047 of the range of the chunk (y: 1/1023), colour
///              1/255 of it, opacity 1/255, components of the rotation 1.42/1023, bands 1/32 (a whole one at +-4,
///              beyond which they are clamped)
Status put_compressed_ply(const scene::Gaussians& gaussians, const SaveOptions& options,
                          ByteSink& to);
inline Result<Buffer> write_compressed_ply(const scene::Gaussians& gaussians,
                                           const SaveOptions& options = {}) {
    return in_memory(put_compressed_ply, gaussians, options);
}

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
Status put_splat(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
inline Result<Buffer> write_splat(const scene::Gaussians& gaussians,
                                  const SaveOptions& options = {}) {
    return in_memory(put_splat, gaussians, options);
}

/// A .ksplat file of GaussianSplats3D: a header of 4096 bytes, one of 1024 for each section, then their data.
/// Level 0 stores float32. Levels 1 and 2 store means as 16-bit offsets in cubes ("buckets", the last ones of a
/// section partly filled), scales and rotations as float16, harmonics as float16 or as bytes of a range that
/// the header has. Colour and opacity are bytes. There is no mark: the name or the caller tells the format.
/// Sections may be of different degrees; the bands that one lacks are zeros. A scale of 0 becomes a
/// logarithm of -infinity, which the report counts.
///
/// Errors       kFormat if damaged, truncated, of counts that contradict each other, or longer than the
///              headers say, unless lenient; kUnsupported for versions other than 0.1, and above the limit
/// Precision    of the format: levels 1 and 2: mean 1/131068 of the block's size; level 2: harmonics 1/510
///              of their range
/// Source       mkkellogg/GaussianSplats3D, class SplatBuffer
Result<LoadedScene> read_ksplat(Bytes file, const LoadOptions& options = {});

/// Axes of a .spz file, unless options name others.
inline constexpr scene::Frame kSpzFrame = scene::Frame::kRub;

/// The file starts with the mark of gzip or of .spz.
Result<bool> is_spz(Bytes file);

/// A .spz file of version 1 to 4: gzip of header and arrays (1 to 3; also without the gzip), or a
/// header with a table of zstd streams (4). Its flag says whether the scene is antialiased. Bands above kMaxShDegree
/// (.spz has 4) and extensions are skipped and reported.
///
/// Errors       kFormat if damaged, truncated, or longer than the header says, unless lenient;
///              kUnsupported for other versions, for extensions before version 4, and above the limit
/// Source       nianticlabs/spz, whose README and loader describe the layout
Result<LoadedScene> read_spz(Bytes file, const LoadOptions& options = {});

/// Gaussians with a scale that a .spz file does not hold: below exp(-10) or above exp(5.9375), rounded.
std::uint64_t scales_beyond_spz(const scene::Gaussians& gaussians);

/// Version 3, or 4 by the options (smaller files, which fewer programs read).
///
/// Errors       as prepare_save(); kInvalidArgument if a value is not finite, or a mean beyond +-2^23
///              units; kUnsupported for other versions
/// Precision    half a step of: mean 2^-12 units (coarser if a mean is beyond 2048, finer in small scenes),
///              log scale 1/16, opacity 1/255, colour 1/255/0.15, band 1 1/16, bands 2 and 3 1/8; rotation within
///              0.005 radians. Clamped: log scale to [-10, 5.94], band 0 to +-3.33, others to [-1, 1)
Status put_spz(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
inline Result<Buffer> write_spz(const scene::Gaussians& gaussians,
                                const SaveOptions& options = {}) {
    return in_memory(put_spz, gaussians, options);
}

/// A .gltf (JSON; buffers in data URIs or, read by path, in files below its folder) or .glb with the extension
/// KHR_gaussian_splatting: all primitives of the scene that is shown first, as the nodes place them. Such a scene is
/// sorted by distance, and each Gaussian ends at 3 sigma (scene::DrawnAs). Opacities 0 and 1 become logits of
/// -/+ kMaxOpacityLogit. Negative scales make a file of a draft, which had logarithms. Surfaces, materials, cameras,
/// animations and extras are ignored and reported.
///
/// Errors       kFormat; kUnsupported for compressed files, required extensions, both colour spaces in a scene, nodes
///              that mirror or shear, files beside a .gltf in memory, and above the limit; as read_file()
/// Source       Khronos Group, glTF 2.0 and KHR_gaussian_splatting
Result<LoadedScene> read_gltf(Bytes file, const LoadOptions& options = {});
Result<LoadedScene> read_glb(Bytes file, const LoadOptions& options = {});

/// One mesh of points with the extension; a .gltf has its bytes in a data URI. Points have the constant colours
/// (COLOR_0) in programs without the extension. Opacities that compensate for dilation are written with a warning.
///
/// Errors       as prepare_save(); kInvalidArgument for values that are not finite, or scales that float32 does not
///              hold; kUnsupported for a .glb of more than 4 GB
/// Precision    exact, except the float32 rounding of exp(log scale), 2^-24 of a scale, and of the opacity, 2^-25
Status put_gltf(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
Status put_glb(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
inline Result<Buffer> write_gltf(const scene::Gaussians& gaussians,
                                 const SaveOptions& options = {}) {
    return in_memory(put_gltf, gaussians, options);
}
inline Result<Buffer> write_glb(const scene::Gaussians& gaussians,
                                const SaveOptions& options = {}) {
    return in_memory(put_glb, gaussians, options);
}

/// The file starts with the mark of an archive, or is a meta.json of SOG.
Result<bool> is_sog(Bytes file);

/// A .sog file of PlayCanvas, version 1 or 2: an archive of meta.json and lossless WebP images, or the meta.json whose
/// images lie in LoadOptions::folder. Images may be larger than the count needs, all of one size.
///
/// Errors       kFormat if damaged or truncated, an image is missing, too small or of another size than the others, a
///              label is beyond the palette, or an image lies outside of the folder; kUnsupported for other versions
///              and above the limit
/// Memory       within the decode budget of all files together; read_webp() takes more
/// Source       PlayCanvas, SOG format specification
Result<LoadedScene> read_sog(Bytes file, const LoadOptions& options = {});

/// Version 2, an archive. Gaussians are put into the order of sort_morton(). Harmonics get a palette of
/// 1024 * 2^floor(log2(count / 1024)) entries, at most 65,536, or of all up to 1024 Gaussians (make_palette()).
///
/// Errors       as prepare_save(); kInvalidArgument if a value is not finite, or a colour beyond +-10^6;
///              kUnsupported above 16380^2 Gaussians, 2^25 with harmonics
/// Precision    half a step of: sign(x) ln(1 + |x|) of a mean 1/65535 of the scene's range on that axis; opacity 1/255;
///              rotation sqrt(2)/255 a component. Log scales and colours: the nearest of 256 numbers each, chosen for
///              all values (make_codebook()); harmonics: the entry of the palette, of 256 numbers, too
/// Determinism  the same bits in every run and for every number of threads, for one version of libwebp
Status put_sog(const scene::Gaussians& gaussians, const SaveOptions& options, ByteSink& to);
inline Result<Buffer> write_sog(const scene::Gaussians& gaussians,
                                const SaveOptions& options = {}) {
    return in_memory(put_sog, gaussians, options);
}

}  // namespace splat::io
