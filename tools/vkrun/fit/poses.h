#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/os/path.h"

namespace vkrun {

/// Photographs whose cameras are wanted.
struct PoseTask {
    std::filesystem::path photos;    ///< their folder
    std::vector<std::string> names;  ///< files in it, in order
    bool ordered = false;            ///< neighbours were taken one after another
    bool one_camera = false;         ///< one lens took all
    std::filesystem::path work;      ///< folder of what COLMAP makes; what is there is gone on with
    std::string log;                 ///< file that gets what COLMAP says
};

/// What COLMAP found.
struct Poses {
    std::filesystem::path model;  ///< folder of the model with the most photographs; empty: none
    std::size_t registered = 0;   ///< photographs in it
    std::size_t models = 0;
};

/// Throws a Failure with what to do where COLMAP is missing.
void check_colmap();

/// Find the cameras of photographs by COLMAP, on the CPU: features, matches (of all pairs, or of neighbours where the
/// photographs are ordered or more than 200), mapper. Shows its progress on standard error. Throws a Failure where
/// COLMAP fails, and as run_child().
Poses find_poses(const PoseTask& task);

}  // namespace vkrun
