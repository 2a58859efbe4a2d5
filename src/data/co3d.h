#pragma once

#include <span>

#include "data/dataset_reader.h"

namespace splat::data {

/// CO3D as preprocessed for Splatter Image: [{path}/co3d_{category}_for_gs/]{split}/ with camera_Rs.npz,
/// camera_Ts.npz (an array of all frames for each sequence) and {sequence}/ with focal_lengths.npy [F,1,2]
/// (in half sides) and images_fg.npy, else images_full.npy, float32 [F,3,S,S] from 0 to 1, and optionally maps,
/// depths.npy and masks.npy [F,1,S,S] and normals.npy [F,3,S,S]. Sequences of the excluded file are left out.
/// Precision: images are kept in 8 bits.
Result<bool> is_co3d(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_co3d(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of PyTorch3D's R [3,3] and T [3]. Errors: kFormat for a
/// matrix that is not a rotation.
Result<scene::Mat4> pose_of_co3d(std::span<const float> rotation,
                                 std::span<const float> translation);

}  // namespace splat::data
