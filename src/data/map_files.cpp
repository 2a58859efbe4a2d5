#include "data/map_files.h"

#include <algorithm>

#include "data/folder.h"
#include "io/folder.h"

namespace splat::data {

namespace fs = std::filesystem;

Status find_map_files(const fs::path& folder, const std::vector<std::string>& stems, bool lenient,
                      DatasetIndex& index) {
    std::vector<std::string> expected = stems;
    std::sort(expected.begin(), expected.end());
    for (const MapKind kind : kMaps) {
        std::vector<std::string> found;
        SPLAT_ASSIGN(const std::vector<std::string> images, images_in(folder / map_name(kind)));
        for (const std::string& name : images) found.push_back(fs::path(name).stem().string());
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
    SPLAT_ASSIGN(const bool is_usual, io::has_file(usual.string()));
    if (is_usual) return usual;
    SPLAT_ASSIGN(const std::vector<std::string> images, images_in(folder / map_name(kind)));
    for (const std::string& name : images)
        if (fs::path(name).stem().string() == stem) return folder / map_name(kind) / name;
    return error(Code::kNotFound, "'%s' has no image '%s'", (folder / map_name(kind)).c_str(),
                 stem.c_str());
}

}  // namespace splat::data
