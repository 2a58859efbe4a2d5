#pragma once

#include <span>

#include "data/dataset_reader.h"

namespace splat::data {

/// ShapeNet renders of 64 x 64 pixels in NMR's layout: {path}/{category}/softras_{split}.lst names objects,
/// one per line; {path}/{category}/{object}/ holds image/*.{png,jpg} and cameras.npz with world_mat_inv_{i}
/// (camera-to-world), else world_mat_{i} (its inverse), [3,4] or [4,4], and camera_mat_{i}, and optionally maps, see
/// map_files.h. Objects are named "{category}_{object}", as the published code does. With a views file, the test
/// objects and their order are those of that file.
Result<bool> is_nmr(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_nmr(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of a world_mat_inv of [3,4] or [4,4]: y points up in its world, z in ours.
/// Errors: kFormat for a matrix that is not a rigid motion.
Result<scene::Mat4> pose_of_nmr(std::span<const float> world_mat_inv);

}  // namespace splat::data
