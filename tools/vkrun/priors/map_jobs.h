#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace vkrun {

/// A picture and where its maps go: OUT/<folder>/<map>/<stem><extension>.
struct MapJob {
    std::filesystem::path picture;
    std::filesystem::path folder;  ///< the folder that holds the folders of maps
    std::string stem;

    [[nodiscard]] std::filesystem::path map_path(const std::string& map,
                                                 const std::string& extension) const {
        return folder / map / (stem + extension);
    }
};

/// Part `index` of `count` of the pictures, "I/N" with I from 0 to N - 1. Throws a usage Failure.
struct Shard {
    std::size_t index = 0, count = 1;
};
Shard parse_shard(const std::string& text);

/// The pictures of IN in order: a picture; a folder of pictures; or a data set, a folder with folders rgb/ at any
/// depth, whose maps go beside them in a copy of its layout (`in` itself: into the data set). Throws a Failure
/// without any, and for two pictures of one stem.
std::vector<MapJob> map_jobs(const std::filesystem::path& in, const std::filesystem::path& out,
                             const Shard& shard);

/// Removes files that killed processes left in the folders of a map: "<name>.<process>-<number>.tmp".
void remove_stale_maps(const std::vector<MapJob>& jobs, const std::string& map);

}  // namespace vkrun
