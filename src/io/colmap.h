#pragma once

#include "io/bytes.h"
#include "io/camera_set.h"
#include "io/colored_points.h"

namespace splat::io {

/// Cameras of a COLMAP model: the lens from `cameras`, the pose and the name of the image from
/// `images`; in the order of `images`. Models PINHOLE and SIMPLE_PINHOLE; SIMPLE_RADIAL, RADIAL, OPENCV and
/// FULL_OPENCV where their distortion is 0, ignored or kept; OPENCV_FISHEYE, FOV, SIMPLE_RADIAL_FISHEYE,
/// RADIAL_FISHEYE and THIN_PRISM_FISHEYE where it is ignored, as pinholes, or kept.
///
/// Errors       kFormat with line or byte, also for an id that appears twice, bytes after the last record and a model
///              without images; kUnsupported for other models, distortion and lenses that are not ignored, and
///              more cameras than the options allow
/// Source       COLMAP's documentation, "Output Format"
Result<CameraSet> read_colmap_text(Bytes cameras, Bytes images, const CameraOptions& options = {});
Result<CameraSet> read_colmap_binary(Bytes cameras, Bytes images,
                                     const CameraOptions& options = {});

/// The bytes of either kind: a binary file starts with a count of 8 bytes, of which some are 0.
Result<CameraSet> read_colmap(Bytes cameras, Bytes images, const CameraOptions& options = {});

/// Where the files of a model may lie in a folder: also as its mapper and as its undistorter write them.
inline constexpr const char* kColmapFolders[] = {"", "sparse/0", "sparse"};

/// The cameras.bin or cameras.txt of the model in a folder; empty if there is none. Errors: as kind_of().
Result<std::string> find_colmap(const std::string& folder);

/// cameras.bin and images.bin of a folder, else cameras.txt and images.txt, in the first of kColmapFolders that has
/// some. Errors: as above and as read_file(); kNotFound if there are none.
Result<CameraSet> load_colmap(const std::string& folder, const CameraOptions& options = {});

/// The points of its points3D.bin or points3D.txt, with their colours; none if it has no such file. Errors: as
/// load_colmap().
Result<ColoredPoints> load_colmap_points(const std::string& folder);

}  // namespace splat::io
