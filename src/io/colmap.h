#pragma once

#include "io/bytes.h"
#include "io/camera_set.h"

namespace splat::io {

/// Cameras of a COLMAP model: the lens from `cameras`, the pose and the name of the image from
/// `images`; in the order of `images`. Models PINHOLE and SIMPLE_PINHOLE; SIMPLE_RADIAL, RADIAL, OPENCV and
/// FULL_OPENCV where their distortion is 0 or ignored; OPENCV_FISHEYE, FOV, SIMPLE_RADIAL_FISHEYE,
/// RADIAL_FISHEYE and THIN_PRISM_FISHEYE as pinholes where that is ignored.
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

/// cameras.bin and images.bin of a folder, else cameras.txt and images.txt; else those of its subfolder
/// sparse/0. Errors: as above and as read_file(); kNotFound if there are none.
Result<CameraSet> load_colmap(const std::string& folder, const CameraOptions& options = {});

}  // namespace splat::io
