// glTF, in text and in bytes: what is accepted can be written in the other form, which says the same.

#include "fuzz/gltf_repair.h"
#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const bool is_glb = io::as_text(file).starts_with(fuzz::kGlbMark);
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

SPLAT_FUZZ_MUTATOR(fuzz::repair_glb)
