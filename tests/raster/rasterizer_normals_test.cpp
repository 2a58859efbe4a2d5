#include <gtest/gtest.h>

#include "ops/op_harness.h"
#include "raster/fragile.h"
#include "raster/raster_compare.h"
#include "raster/raster_scenes.h"
#include "raster/rasterizer_harness.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

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
