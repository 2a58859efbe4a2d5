// .ply, plain and compressed: what is accepted survives being written and read again, bit by bit; where the numbers are
// finite, as a compressed one, too.

#include <cstring>

#include "fuzz/target.h"
#include "io/scene_formats.h"

using namespace splat;

SPLAT_FUZZ_TARGET(io::Bytes file) {
    const io::LoadOptions options = fuzz::small_scenes();
    const auto compressed = io::read_compressed_ply(file, options);
    if (fuzz::accepted(compressed.status())) fuzz::check_scene(compressed.value());
    const auto loaded = io::read_ply(file, options);
    if (!fuzz::accepted(loaded.status())) return;
    fuzz::check_scene(loaded.value());
    const auto& scene = loaded.value().gaussians;
    const auto written = io::write_ply(scene);
    fuzz::require(written.ok());
    const auto packed = io::write_compressed_ply(scene);
    if (packed.ok()) {
        const auto unpacked = io::read_compressed_ply(packed.value(), options);
        fuzz::require(unpacked.ok() && unpacked.value().gaussians.count() == scene.count());
    }
    const auto again = io::read_ply(written.value(), options);
    fuzz::require(again.ok());
    fuzz::require(again.value().gaussians.drawn_as == scene.drawn_as);
    const auto& means = again.value().gaussians.means;
    fuzz::require(means.size() == scene.means.size());
    if (!means.empty())
        fuzz::require(std::memcmp(means.data(), scene.means.data(), means.size() * 4) == 0);
}
