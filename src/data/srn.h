#pragma once

#include "data/dataset_reader.h"

namespace splat::data {

/// The folder has the layout of SRN's data.
Result<bool> is_srn(const std::string& path);

/// SRN's ShapeNet renders: [{path}/srn_{category}/]{category}_{split}/{object}/ with intrinsics.txt,
/// pose/*.txt (16 numbers, row-major camera-to-world, OpenCV axes), rgb/*.png, and optionally maps, see map_files.h.
/// The path may also be the folder of one split. Colours are used as stored where images have alpha, as the published
/// code does.
///
/// Errors   naming folder or file: kNotFound without objects; kFormat for images without poses, poses
///          without images, an object of one view; kInvalidArgument for a folder of several categories
Result<std::unique_ptr<DatasetReader>> open_srn(const ReaderDesc& desc);

}  // namespace splat::data
