#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/shard.h"

namespace vkrun {

/// A picture and where its maps go: OUT/<folder>/<map>/<stem><extension>.
struct MapJob {
    std::filesystem::path picture;
    std::filesystem::path folder;  ///< the folder that holds the folders of maps
    std::string stem;

    [[nodiscard]] std::filesystem::path map_path(const std::string& map,
                                                 const std::string& extension) const {
        return folder / splat::os::path_of(map) / splat::os::path_of(stem + extension);
    }
};

/// The pictures of IN in order: a picture; a folder of pictures; or a data set, a folder with folders rgb/ at any
/// depth, whose maps go beside them in a copy of its layout (`in` itself: into the data set). Throws a Failure
/// without any, and for two pictures of one stem.
std::vector<MapJob> map_jobs(const std::filesystem::path& in, const std::filesystem::path& out,
                             const Shard& shard);

/// Removes files that killed processes left in a folder: "<name>.<process>-<number>.tmp"; beside other shards,
/// which may run on other machines, those of an hour ago.
void remove_stale_files(const std::filesystem::path& folder, const Shard& shard);

/// The same in the folders of a map.
void remove_stale_maps(const std::vector<MapJob>& jobs, const std::string& map, const Shard& shard);

}  // namespace vkrun
