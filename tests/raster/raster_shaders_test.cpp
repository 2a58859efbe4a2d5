#include <gtest/gtest.h>

#include "raster/raster_scenes.h"
#include "raster/rasterizer_harness.h"
#include "support/expect_status.h"
#include "support/raster_shader.h"
#include "support/require_vulkan.h"
#include "vk/shaders.h"

namespace splat::test {
namespace {

/// Profiles name the shaders that ran. Recording checks each declaration against its shader.
TEST(RasterShaders, EveryModuleIsUsed) {
    std::string used;
    const RasterCase scene = random_scene({20, 33, 20}, 3);
    const RasterCase many = random_scene({20, 16 * 513, 16}, 4);  // too many tiles to be ordered
    ref::RasterLoss<double> loss;
    loss.grad_rgb.assign(3 * scene.pixels(), 1.0);
    for (const vk::Kernels kernels : kernels_to_test()) {
        vk::ContextDesc desc = context_desc(kernels);
        desc.profile = true;
        const auto context = make_context(desc);
        raster::RasterDesc all = raster_desc(scene, kRasterModes[1]);
        all.contributions = true;
        ASSERT_OK(run_raster(*context, scene, all, &loss).status);
        ASSERT_OK(run_raster(*context, many, raster_desc(many, kRasterModes[1])).status);
        used += context->profile()->json("");
    }
    if (kernels_to_test().size() < 3)
        SPLAT_SKIP_FOR_DEVICE("this device does not run all sets of kernels");
    for (const vk::ShaderModule& module : vk::shader_modules())
        if (is_raster_shader(module.name)) {
            EXPECT_HAS(used, "\"" + std::string(module.name) + "\"")
                << module.name << " is built in, but nothing uses it";
        }
}

}  // namespace
}  // namespace splat::test
