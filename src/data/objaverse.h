#pragma once

#include <span>

#include "data/dataset_reader.h"

namespace splat::data {

/// Renders of Objaverse in Zero123's layout: {path}/{object}/*.png with *.npy of the same name,
/// world-to-camera [3,4] with OpenGL axes; focal length 140 pixels of 128; optionally maps in {object}/, see
/// map_files.h. The first 99 of 100 objects, rounded down, are for training and the others for validation: of the
/// list of objects in its order, else of the folders by name. There is no split for tests.
Result<bool> is_objaverse(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_objaverse(const ReaderDesc& desc);

/// The same in {path}/{object}/render_mvs_25/model/. The splits val and test hold all objects; there is none to train.
Result<bool> is_gso(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_gso(const ReaderDesc& desc);

/// OpenCV camera-to-world, row-major, of a world-to-camera [3,4] with OpenGL axes. Errors:
/// kFormat for a matrix that is not a rigid motion.
Result<scene::Mat4> pose_of_objaverse(std::span<const float> world_to_camera);

}  // namespace splat::data
