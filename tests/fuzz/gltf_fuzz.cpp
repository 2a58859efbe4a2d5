// glTF, in text and in bytes: what is accepted can be written in the other form, which says the same.

#include "fuzz/checksums.h"
#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

namespace {

constexpr std::string_view kMark = "glTF";

/// Makes the lengths of a .glb right: of the file, of its JSON where that is too long, and of the bytes after it.
void repair_glb(std::span<std::byte> file) {
    constexpr std::size_t kHeader = 12, kChunk = 8;
    if (file.size() < kHeader + kChunk || !io::as_text(file).starts_with(kMark)) return;
    const auto put = [file](std::size_t at, std::size_t value) {
        fuzz::put_number(file, at, static_cast<std::uint32_t>(value), std::endian::little);
    };
    put(8, file.size());
    const std::size_t left = (file.size() - kHeader - kChunk) / 4 * 4;
    std::size_t json = fuzz::number_at(file, kHeader, std::endian::little) / 4 * 4;
    json = json > left ? left : json;
    put(kHeader, json);
    const std::size_t next = kHeader + kChunk + json;
    if (file.size() - next >= kChunk) put(next, (file.size() - next - kChunk) / 4 * 4);
}

}  // namespace

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const bool is_glb = io::as_text(file).starts_with(kMark);
    const auto loaded = is_glb ? io::read_glb(file, fuzz::small_scenes())
                               : io::read_gltf(file, fuzz::small_scenes());
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    const scene::Gaussians& scene = loaded.value().gaussians;
    const auto other = is_glb ? io::write_gltf(scene) : io::write_glb(scene);
    if (!other.ok()) return;
    const auto again = is_glb ? io::read_gltf(other.value()) : io::read_glb(other.value());
    fuzz::require(again.ok() && again.value().gaussians.means == scene.means);
    fuzz::require(again.value().gaussians.sh == scene.sh);
    fuzz::require(again.value().gaussians.drawn_as == scene.drawn_as);
}

SPLAT_FUZZ_MUTATOR(repair_glb)
