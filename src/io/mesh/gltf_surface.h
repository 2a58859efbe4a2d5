#pragma once

#include <map>
#include <optional>
#include <string>

#include "io/mesh/textures.h"
#include "io/scenes/gltf.h"

namespace splat::io::gltf {

/// The materials of a document: each that a primitive names becomes one of the mesh.
class SurfaceMaterials {
  public:
    SurfaceMaterials(Document& document, const MeshOptions& options, LoadedMesh& to)
        : document_(document), textures_(options), lenient_(options.lenient), to_(to) {}

    struct Found {
        std::uint32_t index = 0;         ///< in the mesh
        std::uint64_t texcoord_set = 0;  ///< whose coordinates its texture takes
        bool textured = false;
    };

    /// Material `index` of the document; the usual one of the specification for none. Errors: kFormat; as
    /// MeshTextures::add().
    Result<Found> find(std::optional<std::uint64_t> index);

  private:
    Result<Found> read(const JsonTree& json, const std::string& where);
    Status read_alpha(const JsonTree& json, const std::string& where, scene::MeshMaterial& to);
    Status read_texture(const JsonTree& info, const std::string& where, scene::MeshMaterial& to,
                        Found& found);
    Status read_sampler(const JsonTree& texture, const std::string& where, scene::MeshMaterial& to);

    Document& document_;
    MeshTextures textures_;
    bool lenient_;
    LoadedMesh& to_;
    std::map<std::optional<std::uint64_t>, Found> known_;
};

}  // namespace splat::io::gltf
