#pragma once

#include <filesystem>

#include "data/dataset_reader.h"

namespace splat::data {

/// Maps of an object in folders depth/, normal/ and mask/ beside its images, of any image format, with the stems of
/// its views: takes the kinds that the object lacks out of index.maps. Errors: kFormat for a folder with other
/// stems; if lenient, a problem of the last object of the index.
Status find_map_files(const std::filesystem::path& folder, const std::vector<std::string>& stems,
                      bool lenient, DatasetIndex& index);

/// Errors: kNotFound if there is none.
Result<std::filesystem::path> map_file(const std::filesystem::path& folder, MapKind kind,
                                       const std::string& stem);

}  // namespace splat::data
