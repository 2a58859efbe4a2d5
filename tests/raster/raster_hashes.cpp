// raster_hashes [runs]: prints one line per scene, mode and set of kernels, with a hash of the
// image and one of all gradients. Every run makes a new rasterizer, whose second frame must equal
// the first. reproducible.cmake compares its output for different numbers of driver threads, with
// and without validation.
#include <bit>
#include <cstdio>
#include <cstdlib>

#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

std::uint64_t hash_of(const std::vector<float>& values, std::uint64_t hash) {
    for (const float value : values)  // FNV-1a over words
        hash = (hash ^ std::bit_cast<std::uint32_t>(value)) * 0x100000001B3ULL;
    return hash;
}

struct Hashes {
    std::uint64_t image = 0xCBF29CE484222325ULL;
    std::uint64_t gradients = 0xCBF29CE484222325ULL;

    bool operator==(const Hashes&) const = default;
};

Result<Hashes> frame(vk::Context& context, RasterSession& session, std::size_t pixels) {
    Hashes hashes;
    SPLAT_TRY(session.forward());
    hashes.image = hash_of(session.image(), hashes.image);
    SPLAT_TRY(session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)));
    hashes.gradients = hash_of(session.gradients(), hashes.gradients);
    hashes.gradients = hash_of(session.exported(), hashes.gradients);
    const vk::BufferView pose = session.rasterizer().workspace().pose.range();
    hashes.gradients = hash_of(download(context, pose, 12), hashes.gradients);
    return hashes;
}

/// The common hash of `runs` rasterizers with two frames each. Errors: those of the calls, and
/// kInternal if a frame differs from the first.
Result<Hashes> same_hash(vk::Context& context, const RasterCase& scene, const RasterMode& mode,
                         int runs) {
    Hashes first;
    for (int run = 0; run < runs; ++run) {
        RasterSession session(context, scene, with_gradients(raster_desc(scene, mode)));
        SPLAT_TRY(session.status());
        for (int again = 0; again < 2; ++again) {
            SPLAT_ASSIGN(const Hashes hashes, frame(context, session, scene.pixels()));
            if (run == 0 && again == 0) first = hashes;
            if (hashes != first)
                return error(Code::kInternal, "run %d, frame %d differs from the first", run,
                             again);
        }
    }
    return first;
}

/// The second scene has more pairs than the first arrays hold. One run is the quick test.
std::vector<RasterCase> scenes(bool quick) {
    RasterCase crowded = opaque_scene({quick ? 480U : 700U, 70, 45}, 102);
    for (float& opacity : crowded.opacities) opacity *= 0.02F;
    if (quick) return {random_scene({600, 45, 61}, 101, 2), crowded};
    return {random_scene({1500, 75, 61}, 101, 2), crowded, tie_scene({150, 65, 50}, 103)};
}

int print_all(int runs) {
    int failed = 0;
    for (const RasterCase& scene : scenes(runs == 1)) {
        for (const RasterMode& mode : kRasterModes) {
            if (runs == 1 && &mode == &kRasterModes[1]) continue;
            for (const vk::Kernels kernels : kernels_to_test()) {
                if (runs == 1 && kernels == vk::Kernels::kGpu) continue;
                vk::Context* context = shared_context(kernels);
                if (context == nullptr) return 1;
                const auto hashes = same_hash(*context, scene, mode, runs);
                const char* what = vk::kernels_name(kernels);
                if (!hashes.ok()) {
                    std::fprintf(stderr, "%s %s %s: %s\n", scene.name.c_str(), mode.name, what,
                                 hashes.status().message().c_str());
                    failed = 1;
                    continue;
                }
                std::printf("%s %s %s image %016llx gradients %016llx\n", scene.name.c_str(),
                            mode.name, what, static_cast<unsigned long long>(hashes.value().image),
                            static_cast<unsigned long long>(hashes.value().gradients));
            }
        }
    }
    return failed;
}

}  // namespace
}  // namespace splat::test

int main(int argc, char** argv) {
    const int runs = argc > 1 ? std::atoi(argv[1]) : 1;
    const int failed = splat::test::print_all(runs > 0 ? runs : 1);
    splat::test::close_shared_contexts();
    return failed;
}
