#include <filesystem>

#include "core/os/path.h"
#include "io/file.h"
#include "io/mesh/mesh.h"
#include "io/reader.h"

namespace splat::io {

Result<LoadedMesh> load_mesh(const std::string& path, MeshOptions options) {
    const std::string extension = extension_of(path);
    const bool is_gltf = extension == ".glb" || extension == ".gltf";
    if (!is_gltf && extension != ".obj")
        return unsupported("'%s': a mesh is expected as .obj, .glb or .gltf", path.c_str());
    options.folder = os::text_of(os::path_of(path).parent_path());
    if (options.folder->empty()) options.folder = ".";
    SPLAT_ASSIGN(const Buffer file, read_file(path));
    SPLAT_ASSIGN(LoadedMesh loaded,
                 in_file(is_gltf ? read_gltf_mesh(file, options) : read_obj(file, options), path));
    if (loaded.mesh.triangles.empty())
        return damaged("'%s': the mesh has no faces, expected triangles or polygons", path.c_str());
    return loaded;
}

}  // namespace splat::io
