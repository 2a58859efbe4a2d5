// Random scenes of all kinds, sizes and modes against the float64 reference. A failure prints the
// seed of its scene.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/environment.h"
#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/rng_fill.h"
#include "raster/fragile.h"
#include "raster/raster_compare.h"
#include "raster/rasterizer_harness.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

/// Numbers at thresholds of the kernels, or at which they lose digits.
float poison(Rng& rng) {
    constexpr float kNumbers[] = {0.0F,     1e-30F, 1e-6F, 1.0F / 255, 1.0F / 256, 0.01F,
                                  0.98999F, 0.99F,  1.0F,  0.2F,       0.5F,       16.0F};
    return kNumbers[rng.below(std::size(kNumbers))];
}

RasterCase any_scene(std::uint64_t seed) {
    Rng rng(seed * 977 + 5);
    const SceneSize size = {1 + rng.below(70), 1 + rng.below(70), 1 + rng.below(50)};
    RasterCase scene;
    switch (rng.below(6)) {
        case 0:
            scene = wide_scene(size, seed);
            break;
        case 1:
            scene = opaque_scene(size, seed);
            break;
        case 2:
            scene = tie_scene(size, seed);
            break;
        default:
            scene = random_scene(size, seed, rng.below(4));
            break;
    }
    for (std::size_t i = 0; i < scene.count(); ++i) {
        if (rng.below(12) == 0) scene.opacities[i] = std::min(poison(rng), 1.0F);
        if (rng.below(15) == 0) scene.scales[3 * i + rng.below(3)] = 0.1F * poison(rng);
        if (rng.below(20) == 0) scene.means[3 * i + rng.below(3)] = poison(rng);
        for (std::size_t k = 0; k < 4 && i % 5 == 0; ++k) scene.rotations[4 * i + k] *= 1.01F;
    }
    scene.camera.cx += static_cast<float>(6 * rng.normal());
    scene.camera.cy += static_cast<float>(6 * rng.normal());
    scene.camera.fy *= static_cast<float>(std::exp(0.2 * rng.normal()));
    scene.camera.world_to_camera[11] -= static_cast<float>(rng.below(3));
    scene.name = "seed " + std::to_string(seed);
    return scene;
}

class RasterizerRandom : public KernelsTest {
  protected:
    void expect_seeds(std::uint64_t first, std::uint64_t count, bool or_float32) {
        std::size_t hidden = 0;
        for (std::uint64_t seed = first; seed < first + count; ++seed) {
            const RasterCase scene = any_scene(seed);
            SCOPED_TRACE("seed " + std::to_string(seed));
            for (const RasterMode& mode : kRasterModes)
                if (expect_like_reference(context(), scene, mode, ref::RasterGradient::kTrue,
                                          or_float32)
                        .fragile > 0.5)
                    ++hidden;
            if (seed % 4 == 0)
                expect_like_reference(context(), scene, kRasterModes[0],
                                      ref::RasterGradient::kOriginal, or_float32);
        }
        EXPECT_LE(hidden, count / 2) << "most pixels of these images were not compared strictly";
    }
};
SPLAT_INSTANTIATE_KERNELS(RasterizerRandom);

TEST_P(RasterizerRandom, FewSeeds) {
    expect_seeds(1, 12, false);
}

class RasterizerRandomFull : public RasterizerRandom {};
SPLAT_INSTANTIATE_KERNELS(RasterizerRandomFull);

/// SPLAT_TEST_SEED sets the first seed.
TEST_P(RasterizerRandomFull, ManySeeds) {
    const std::string first = environment("SPLAT_TEST_SEED").value_or("1000");
    expect_seeds(std::strtoull(first.c_str(), nullptr, 10), 400, true);
}

class RasterizerNormals : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerNormals);

// Golden files hold no normals; everything else of the same scenes is compared there.
TEST_P(RasterizerNormals, MatchFloat64) {
    const RasterCase scene = random_scene({200, 67, 45}, 31);
    for (const RasterMode& mode : kRasterModes) {
        const ref::RasterScene<double> reference = reference_scene<double>(scene, mode);
        RasterOutputs expected;
        expected.normal = reference_outputs(reference).normal;
        const RasterRun run = run_raster(context(), scene, raster_desc(scene, mode));
        ASSERT_OK(run.status) << mode.name;
        RasterOutputs got;
        got.normal = run.outputs.normal;
        RasterSubject subject;
        subject.what = mode.name;
        subject.fragile = fragile_pixels(reference);
        EXPECT_TRUE(outputs_match(got, expected, subject));
    }
}

}  // namespace
}  // namespace splat::test
