#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace vkrun {

/// A mesh that becomes an object of a data set.
struct MeshFile {
    std::string path;
    std::string name;  ///< object's name, as one part of a path
    std::string split;
};

/// The meshes of files and folders, .obj, .glb and .gltf, sorted by name. An object has the stem of its file, or
/// where that says nothing (model.obj, models/model_normalized.obj as in ShapeNet, scene.gltf) the name of the
/// folder. Throws a Failure without any, for an unreadable folder, and for two of one name.
std::vector<MeshFile> find_meshes(const std::vector<std::string>& from);

/// Deals meshes to train, val and test by their names and a seed, so that their order does not matter. Shares are
/// relative; one above 0 gets a mesh where there are enough.
void deal_meshes(std::vector<MeshFile>& meshes, const std::array<double, 3>& shares,
                 std::uint64_t seed);

}  // namespace vkrun
