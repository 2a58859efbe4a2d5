#pragma once

#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "io/mesh/mesh.h"

namespace splat::io {

/// The textures of a mesh: each image is decoded once.
class MeshTextures {
  public:
    explicit MeshTextures(const MeshOptions& options)
        : options_(options), texels_left_(options.max_texels) {}

    /// The texture of the image `key`, which `open` gives where it is not known yet; `where` names it in messages. If
    /// lenient, kNone for one that cannot be read. Errors: of `open`; as read_image(); kUnsupported for more texels
    /// than are left.
    Result<std::uint32_t> add(const std::string& key, const std::function<Result<Bytes>()>& open,
                              const std::string& where, LoadedMesh& to);

  private:
    Result<scene::Texture> decode(Bytes file);

    MeshOptions options_;
    std::uint64_t texels_left_;
    std::map<std::string, std::uint32_t> known_;
};

/// The bytes of a file that a mesh names: `name` is a path from the folder, with '/' or '\\', which may begin with one
/// "..", as those of ShapeNet do. Errors: as read_file(); kFormat for a path that leads elsewhere, and through links;
/// kUnsupported without a folder.
Result<Buffer> read_beside(const std::optional<std::string>& folder, const std::string& name,
                           std::uint64_t max_bytes);

/// Adds what a file says besides, unless there are very many such things already.
void add_ignored(std::set<std::string>& ignored, const std::string& what);

/// A material of a .mtl file.
struct MtlMaterial {
    std::string name;
    scene::MeshMaterial material;
    std::string image;  ///< map_Kd as written; empty: none
};

/// The materials of a .mtl file in their order; what else it says is added to `ignored`.
///
/// Errors   kFormat, naming the line: text where a number belongs, a number that is not finite, a value before newmtl,
///          a missing name
Result<std::vector<MtlMaterial>> read_mtl(Bytes file, std::set<std::string>& ignored);

}  // namespace splat::io
