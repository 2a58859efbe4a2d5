#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/os/path.h"

namespace vkrun {

/// Paths of maps by their names: the path below the folder, without the extension.
using MapFiles = std::map<std::string, std::filesystem::path>;

/// The maps below a folder: files that splat_image_load reads. Where some lie in folders named `kind` ("depth",
/// "normal", "mask", "plane"), as in SRN's layout, only those, and their names leave that folder out; masks may also be
/// the alpha of pictures in folders named rgb. Other folders of that layout hold no maps of the kind, and names
/// that start with '.' are skipped. Throws a Failure of bad data if there is no map, or two have one name.
MapFiles find_maps(const std::filesystem::path& folder, const std::string& kind);

/// Names of maps to names of their groups. A file of lines "GROUP NAME"; NAME is that of a map or of a
/// folder of maps. Empty lines and those that start with # are skipped. Throws a Failure that names the line.
class MapGroups {
  public:
    MapGroups() = default;
    explicit MapGroups(const std::string& path);

    /// The group of a map or of the nearest folder above it that has one; empty: none.
    [[nodiscard]] std::string of(const std::string& map) const;
    /// Groups in the order of the file.
    [[nodiscard]] const std::vector<std::string>& names() const { return names_; }
    /// Names of the file that are of no map.
    [[nodiscard]] std::vector<std::string> unknown(const MapFiles& maps) const;

  private:
    std::map<std::string, std::string> groups_;
    std::vector<std::string> names_;
};

}  // namespace vkrun
