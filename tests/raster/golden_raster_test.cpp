// The kernels against every file of golden/raster, in every convention and with every loss.

#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "raster/golden_scene.h"
#include "raster/rasterizer_harness.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

class GoldenRaster : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GoldenRaster);

/// Runs forward and backward with one loss and compares outputs and gradients.
std::vector<float> compare_loss(vk::Context& context, const GoldenScene& scene,
                                const RasterMode& mode, const GoldenLoss& loss,
                                RasterGradients expected) {
    if (!expected.world_to_camera.empty()) expected.world_to_camera.resize(12);  // [R|t]
    raster::RasterDesc desc = raster_desc(scene.inputs, mode);
    desc.original_gradient = loss.gradient == ref::RasterGradient::kOriginal;
    const ref::RasterLoss<double> weights = scene.loss<double>(loss);
    const RasterRun run = run_raster(context, scene.inputs, desc, &weights);
    RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat32);
    subject.what += std::string(" ") + loss.name;
    EXPECT_OK(run.status) << subject.what;
    EXPECT_TRUE(outputs_match(run.outputs, scene.outputs(mode), subject));
    EXPECT_TRUE(gradients_match(run.gradients, expected, subject));
    return run.image;
}

void compare(vk::Context& context, const GoldenScene& scene, const RasterMode& mode) {
    if (!scene.has(mode)) return;
    const RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat32);
    raster::RasterDesc everything = raster_desc(scene.inputs, mode);
    everything.skips = {false, false, false, false, false, false};
    const RasterRun slow = run_raster(context, scene.inputs, everything);
    ASSERT_OK(slow.status) << subject.what;
    EXPECT_TRUE(outputs_match(slow.outputs, scene.outputs(mode), subject));
    std::size_t losses = 0;
    for (const GoldenLoss& loss : golden_losses(mode)) {
        const RasterGradients expected = scene.gradients(mode, loss);
        if (expected.means.empty()) continue;
        ++losses;
        EXPECT_EQ(compare_loss(context, scene, mode, loss, expected), slow.image)
            << subject.what << ": skips change the image";
    }
    if (losses > 0) return;
    const RasterRun forward = run_raster(context, scene.inputs, raster_desc(scene.inputs, mode));
    ASSERT_OK(forward.status) << subject.what;
    EXPECT_TRUE(outputs_match(forward.outputs, scene.outputs(mode), subject));
    EXPECT_EQ(slow.image, forward.image) << subject.what << ": skips change the image";
}

TEST_P(GoldenRaster, SmallFilesInEveryConvention) {
    for (const char* family : {"one", "rand50", "ties"}) {
        const std::vector<GoldenScene> scenes = golden_scenes(family);
        EXPECT_GE(scenes.size(), 1U) << family;
        for (const GoldenScene& scene : scenes)
            for (const RasterMode& mode : kRasterModes) compare(context(), scene, mode);
    }
}

class GoldenRasterFull : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(GoldenRasterFull);

TEST_P(GoldenRasterFull, EveryFileInEveryConvention) {
    std::size_t scenes = 0;
    for (const GoldenScene& scene : golden_scenes("")) {
        ++scenes;
        for (const RasterMode& mode : kRasterModes) compare(context(), scene, mode);
    }
    EXPECT_GE(scenes, std::size(kGoldenFamilies));
}

}  // namespace
}  // namespace splat::test
