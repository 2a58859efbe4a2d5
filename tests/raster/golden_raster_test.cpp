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

void compare(vk::Context& context, const GoldenScene& scene, const RasterMode& mode) {
    if (!scene.has(mode)) return;
    const raster::RasterDesc desc = raster_desc(scene.inputs, mode);
    const RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat32);
    const RasterRun forward = run_raster(context, scene.inputs, desc);
    ASSERT_OK(forward.status) << subject.what;
    EXPECT_TRUE(outputs_match(forward.outputs, scene.outputs(mode), subject));
    raster::RasterDesc everything = desc;
    everything.skips = {false, false, false, false, false, false};
    const RasterRun slow = run_raster(context, scene.inputs, everything);
    ASSERT_OK(slow.status) << subject.what;
    EXPECT_TRUE(outputs_match(slow.outputs, scene.outputs(mode), subject));
    EXPECT_EQ(slow.image, forward.image) << subject.what << ": skips change the image";
    for (const GoldenLoss& loss : golden_losses(mode)) {
        RasterGradients expected = scene.gradients(mode, loss);
        if (expected.means.empty()) continue;
        if (!expected.world_to_camera.empty()) expected.world_to_camera.resize(12);  // [R|t]
        raster::RasterDesc with_loss = desc;
        with_loss.original_gradient = loss.gradient == ref::RasterGradient::kOriginal;
        const ref::RasterLoss<double> weights = scene.loss<double>(loss);
        const RasterRun run = run_raster(context, scene.inputs, with_loss, &weights);
        ASSERT_OK(run.status) << subject.what << " " << loss.name;
        RasterSubject with_name = subject;
        with_name.what += std::string(" ") + loss.name;
        EXPECT_TRUE(gradients_match(run.gradients, expected, with_name));
    }
}

TEST_P(GoldenRaster, EveryFileInEveryConvention) {
    std::size_t scenes = 0;
    for (const GoldenScene& scene : golden_scenes("")) {
        ++scenes;
        for (const RasterMode& mode : kRasterModes) compare(context(), scene, mode);
    }
    EXPECT_GE(scenes, std::size(kGoldenFamilies));
}

}  // namespace
}  // namespace splat::test
