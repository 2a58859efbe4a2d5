#pragma once

#include <splat.h>

#include <cstdint>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace vkrun {

/// Add --memory; 0: what the system has available.
void add_memory_option(CLI::App& command, std::uint64_t& bytes);

/// What a command does with the scene of a file, besides reading it and measuring or writing it.
struct SceneUse {
    std::vector<std::string> merged;  ///< files of scenes that are appended to it
    int sh_degree = -1;               ///< degree that it gets, if that is higher
    std::string
        device;  ///< where it is drawn, unless empty; only a CPU draws in the system's memory
    std::string written;  ///< file that it is written to, unless empty
    bool edited = false;  ///< by options other than merges, too
};

/// Throws a bad-data Failure, before the scene is read, if it takes more memory than `allowed` (0: than the system has
/// available). What is wrong with a file otherwise is left to its reader.
void check_memory(const std::string& path, const splat_scene_file_desc& desc, std::uint64_t allowed,
                  const SceneUse& use = {});

}  // namespace vkrun
