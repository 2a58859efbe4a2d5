#pragma once

#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "core/status.h"

namespace splat::data {

/// The name is that of an entry of a folder, and not hidden.
bool is_folder_name(const std::string& name);

/// Names in a JSON array, such as the LVIS objects of Objaverse. Errors: as io::read_file(); kFormat for other
/// JSON, an empty array, and a name that is not that of a folder or occurs twice.
Result<std::vector<std::string>> load_object_list(const std::string& path);

/// All names of CO3D's sequences ("106_12648_23157") in a text, whatever is between them: the list of
/// bad sequences of Splatter Image, or one name a line. Errors: as io::read_file(); kFormat without any name.
Result<std::set<std::string>> load_excluded_sequences(const std::string& path);

/// An object of NMR and the view that evaluations start from.
struct SourceView {
    std::string category;
    std::string object;
    std::uint32_t view = 0;
};

/// Lines "category object view", as PixelNeRF's list of 8761 test objects. Errors: as io::read_file(); kFormat,
/// naming the line, for other lines and an object that occurs twice.
Result<std::vector<SourceView>> load_source_views(const std::string& path);

}  // namespace splat::data
