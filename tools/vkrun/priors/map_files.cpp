#include "vkrun/priors/map_files.h"

#include <algorithm>
#include <set>
#include <sstream>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// Folders of an object in SRN's layout.
const std::set<std::string> kLayout = {"rgb", "depth", "normal", "mask", "plane"};

bool is_map_file(const fs::path& path) {
    static const std::set<std::string> extensions = {".png", ".npy",  ".jpg", ".jpeg",
                                                     ".pfm", ".webp", ".pgm", ".ppm"};
    return extensions.count(extension_of(path)) != 0;
}

/// Files by the folder of the layout that they lie in; "" for none.
std::map<std::string, std::vector<fs::path>> files_by_place(const fs::path& folder) {
    std::map<std::string, std::vector<fs::path>> found;
    std::error_code failed;
    fs::path last = folder;
    fs::recursive_directory_iterator at(folder, fs::directory_options::follow_directory_symlink,
                                        failed);
    for (; !failed && at != fs::recursive_directory_iterator(); at.increment(failed)) {
        last = at->path();
        if (os::text_of(at->path().filename()).front() == '.') {
            at.disable_recursion_pending();
            continue;
        }
        if (!is_map_file(at->path())) continue;
        if (!fs::exists(at->path()))
            throw Failure(kBadData,
                          "'" + os::text_of(at->path()) + "' is a link to what does not exist");
        if (!at->is_regular_file()) continue;
        const fs::path relative = at->path().lexically_relative(folder);
        const std::string place = os::text_of(relative.parent_path().filename());
        found[kLayout.count(place) != 0 ? place : ""].push_back(relative);
    }
    if (failed)
        throw Failure(kBadData,
                      "cannot read the folder '" + os::text_of(last) + "': " + failed.message());
    return found;
}

/// "object/depth/000000.png" to "object/000000".
std::string name_of(const fs::path& relative, bool in_layout) {
    const fs::path folder = relative.parent_path();
    return os::text_of((in_layout ? folder.parent_path() : folder) / relative.stem());
}

}  // namespace

MapFiles find_maps(const fs::path& folder, const std::string& kind) {
    if (!fs::is_directory(folder))
        throw Failure(kBadData, "'" + os::text_of(folder) + "' is no folder");
    const auto found = files_by_place(folder);
    std::vector<std::string> places = {kind, ""};
    if (kind == "mask") places.insert(places.begin() + 1, "rgb");
    for (const std::string& place : places) {
        const auto files = found.find(place);
        if (files == found.end()) continue;
        MapFiles maps;
        for (const fs::path& relative : files->second) {
            const std::string name = name_of(relative, !place.empty());
            const auto [at, fresh] = maps.emplace(name, folder / relative);
            if (!fresh)
                throw Failure(kBadData, "'" + os::text_of(at->second) + "' and '" +
                                            os::text_of(folder / relative) +
                                            "' are both the map '" + name + "'; remove one");
        }
        return maps;
    }
    throw Failure(kBadData,
                  "'" + os::text_of(folder) + "' holds no map of the kind " + kind +
                      ": expected .png, .npy, .jpg, .webp, .pgm or .pfm files, in SRN's layout in "
                      "OBJECT/" +
                      kind);
}

MapGroups::MapGroups(const std::string& path) {
    std::istringstream text(read_text(path));
    std::size_t number = 0;
    for (std::string line; std::getline(text, line);) {
        ++number;
        std::istringstream words(line);
        std::string group, name, more;
        if (!(words >> group) || group.front() == '#') continue;
        if (!(words >> name) || words >> more)
            throw Failure(kUsageError, format("'%s' line %zu: expected a group and a name",
                                              path.c_str(), number));
        if (!groups_.emplace(name, group).second)
            throw Failure(kUsageError, format("'%s' line %zu: '%s' is there twice", path.c_str(),
                                              number, name.c_str()));
        if (std::find(names_.begin(), names_.end(), group) == names_.end()) names_.push_back(group);
    }
    if (names_.empty())
        throw Failure(kUsageError, "'" + path + "' holds no line of a group and a name");
}

std::string MapGroups::of(const std::string& map) const {
    for (std::string name = map; !name.empty();) {
        const auto found = groups_.find(name);
        if (found != groups_.end()) return found->second;
        const std::size_t slash = name.rfind('/');
        name.resize(slash == std::string::npos ? 0 : slash);
    }
    return "";
}

std::vector<std::string> MapGroups::unknown(const MapFiles& maps) const {
    std::vector<std::string> names;
    for (const auto& [name, group] : groups_) {
        const auto below = maps.lower_bound(name + "/");
        const bool known = maps.count(name) != 0 ||
                           (below != maps.end() && below->first.rfind(name + "/", 0) == 0);
        if (!known) names.push_back(name);
    }
    return names;
}

}  // namespace vkrun
