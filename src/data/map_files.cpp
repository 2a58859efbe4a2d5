#include "data/map_files.h"

#include <algorithm>

#include "data/folder.h"

namespace splat::data {

namespace fs = std::filesystem;

Status find_map_files(const fs::path& folder, const std::vector<std::string>& stems, bool lenient,
                      DatasetIndex& index) {
    std::vector<std::string> expected = stems;
    std::sort(expected.begin(), expected.end());
    for (const MapKind kind : kMaps) {
        std::vector<std::string> found;
        for (const std::string& name : images_in(folder / map_name(kind)))
            found.push_back(fs::path(name).stem().string());
        std::sort(found.begin(), found.end());
        if (found.empty()) {
            index.add_lacking(kind, (folder / map_name(kind)).string());
            continue;
        }
        const Status same = check_same(folder.string(), map_name(kind), expected, found);
        if (!same.ok() && !lenient) return same;
        if (!same.ok()) index.problems.back().push_back(same.message());
    }
    return {};
}

Result<fs::path> map_file(const fs::path& folder, MapKind kind, const std::string& stem) {
    fs::path usual = folder / map_name(kind) / (stem + ".png");
    if (is_file(usual)) return usual;
    for (const std::string& name : images_in(folder / map_name(kind)))
        if (fs::path(name).stem().string() == stem) return folder / map_name(kind) / name;
    return error(Code::kNotFound, "'%s' has no image '%s'", (folder / map_name(kind)).c_str(),
                 stem.c_str());
}

}  // namespace splat::data
