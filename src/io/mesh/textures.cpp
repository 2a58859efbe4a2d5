#include "io/mesh/textures.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/photo/image_file.h"
#include "io/reader.h"

namespace splat::io {

Result<scene::Texture> MeshTextures::decode(Bytes file) {
    ImageOptions options;
    options.limits = options_.limits;
    options.header_only = true;
    SPLAT_ASSIGN(const Image head, read_image(file, options));
    const std::uint64_t texels = std::uint64_t{head.width} * head.height;
    if (texels > texels_left_)
        return unsupported(
            "%u x %u texels, but all textures of a mesh may have %llu, of which %llu are left; "
            "make the image smaller",
            head.width, head.height, llu(options_.max_texels), llu(texels_left_));
    options.header_only = false;
    SPLAT_ASSIGN(const Image image, read_image(file, options));
    texels_left_ -= texels;
    scene::Texture texture{image.width, image.height, {}};
    texture.texels.resize(static_cast<std::size_t>(texels));
    const std::size_t channels = image.channels;
    const bool has_alpha = channels == 2 || channels == 4;
    const std::size_t last_color = channels - (has_alpha ? 2 : 1);
    const unsigned shift = image.bits - 8;
    for (std::size_t i = 0; i < texture.texels.size(); ++i) {
        const std::uint16_t* const from = &image.samples[i * channels];
        for (std::size_t k = 0; k < 3; ++k)
            texture.texels[i][k] =
                static_cast<std::uint8_t>(from[std::min(k, last_color)] >> shift);
        texture.texels[i][3] =
            has_alpha ? static_cast<std::uint8_t>(from[channels - 1] >> shift) : 255;
    }
    return texture;
}

Result<std::uint32_t> MeshTextures::add(const std::string& key,
                                        const std::function<Result<Bytes>()>& open,
                                        const std::string& where, LoadedMesh& to) {
    if (const auto found = known_.find(key); found != known_.end()) return found->second;
    std::uint32_t index = scene::kNone;
    const auto take = [&]() -> Status {
        SPLAT_ASSIGN(const Bytes file, open());
        SPLAT_ASSIGN(scene::Texture texture, decode(file));
        index = static_cast<std::uint32_t>(to.mesh.textures.size());
        to.mesh.textures.push_back(std::move(texture));
        return {};
    };
    if (const Status taken = take(); !taken.ok()) {
        const Status named(taken.code(), where + ": " + taken.message());
        if (!options_.lenient) return named;
        add_ignored(to.ignored, named.message());
    }
    return known_[key] = index;
}

void add_ignored(std::set<std::string>& ignored, const std::string& what) {
    constexpr std::size_t kMost = 100;
    ignored.insert(ignored.size() < kMost ? what : "more of these");
}

Result<Buffer> read_beside(const std::optional<std::string>& folder, const std::string& name,
                           std::uint64_t max_bytes) {
    std::string path = name;
    std::ranges::replace(path, '\\', '/');
    if (!folder)
        return unsupported(
            "the file '%s' is named, but the mesh is read from memory; read it by its path",
            shown(name).c_str());
    SPLAT_TRY(check_portable(path));
    const std::string plain = os::text_of(os::path_of(path).lexically_normal());
    const bool above = plain.starts_with("../");
    const std::string inside = above ? plain.substr(3) : plain;
    if (!check_below(inside).ok())
        return damaged(
            "the path '%s' leads elsewhere, expected one from the folder of the mesh, or from that "
            "above it; copy the file there, and change the path",
            shown(name).c_str());
    SPLAT_TRY(check_no_links(*folder, plain, "a path of a mesh"));
    return read_file(os::text_of(os::path_of(*folder) / os::path_of(plain)), max_bytes);
}

}  // namespace splat::io
