#pragma once

#include "data/dataset_reader.h"

namespace splat::data {

/// Photographs with cameras: a folder with transforms_{split}.json, else transforms.json (NeRF's), else a
/// COLMAP model (also in sparse/0 or sparse, with the images in images/); or a folder of such folders, one for each
/// object. Without transforms_{split}.json all splits are equal. Images become the largest square
/// around the principal point, and so do maps (see map_files.h), which have the images' sizes.
Result<bool> is_image_folder(const std::string& path);
/// A sentence on a folder that is no data set: it, images/ in it or a folder in it has pictures, but no cameras, or
/// pictures of a format that is not read. Else empty; what cannot be read counts as nothing.
std::string lack_of_cameras(const std::string& path);
Result<std::unique_ptr<DatasetReader>> open_image_folder(const ReaderDesc& desc);

}  // namespace splat::data
