// Several dispatches per scene, and several submits per dispatch, give the same bits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>

#include "core/fault.h"
#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

class RasterizerSlices : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerSlices);

/// All results of one forward and one backward call.
struct Results {
    std::vector<float> image, normals, gradients, exported, pose;
    raster::RasterStats stats;
    std::uint64_t submits[2] = {0, 0};  ///< forward, backward; 0 without fault points, which count
};

template <class Call>
std::uint64_t submits_of(const Call& call) {
#if SPLAT_FAULT_POINTS
    fault::arm("vk.queue_submit", fault::kForever);
    EXPECT_OK(call());
    return fault::disarm();
#else
    EXPECT_OK(call());
    return 0;
#endif
}

Results results_of(vk::Context& context, const RasterCase& scene, const raster::RasterDesc& desc) {
    RasterSession session(context, scene, desc);
    EXPECT_OK(session);
    if (!session.status().ok()) return {};
    const std::size_t pixels = scene.pixels();
    Results results;
    results.submits[0] = submits_of([&] { return session.forward(); });
    results.submits[1] = submits_of(
        [&] { return session.backward(normal_fill(4 * pixels, 1), normal_fill(pixels, 2)); });
    const raster::Workspace& space = session.rasterizer().workspace();
    results.image = session.image();
    results.normals = download(context, space.normal_image.range(), 4 * pixels);
    results.gradients = session.gradients();
    results.exported = session.exported();
    results.pose = download(context, space.pose.range(), 12);
    results.stats = session.rasterizer().stats();
    return results;
}

/// 700 Gaussians of 12 quads of colours in slices of 256, the last one shorter. A binding holds all records.
TEST_P(RasterizerSlices, SlicesOfGaussiansGiveTheSameBits) {
    const RasterCase scene = random_scene({700, 40, 33}, 95, 3);
    const raster::RasterDesc desc = with_gradients(raster_desc(scene, kRasterModes[1]));
    vk::ContextDesc lowered = context_desc(GetParam());
    lowered.device.fake = [](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 511 * 12 * 16;
    };
    const auto narrow = make_context(lowered);
    ASSERT_EQ(raster::slice_size(narrow->device().info(), GetParam(), desc), 256U);
    ASSERT_GT(raster::slice_size(context().device().info(), GetParam(), desc), 1000U);
    const Results whole = results_of(context(), scene, desc);
    const Results slices = results_of(*narrow, scene, desc);
    ASSERT_EQ(slices.stats.passes, 1U) << "gradients are added in another order";
    EXPECT_EQ(slices.stats.visible, whole.stats.visible);
    EXPECT_GT(whole.stats.visible, 560U);
    EXPECT_EQ(slices.image, whole.image);
    EXPECT_EQ(slices.normals, whole.normals);
    EXPECT_EQ(slices.gradients, whole.gradients);
    EXPECT_EQ(slices.exported, whole.exported);
    EXPECT_EQ(slices.pose, whole.pose);
}

/// With arrays for 800000 pairs, blending is expected to take long, so it is submitted in parts
/// although there are few pairs.
TEST_P(RasterizerSlices, SubmitsInPartsGiveTheSameBits) {
    constexpr std::size_t kSeen = 60;
    RasterCase roomy = random_scene({kSeen + 200000, 75, 61}, 96, 1);
    for (float& scale : roomy.scales) scale *= 40;
    std::fill(roomy.opacities.begin() + kSeen, roomy.opacities.end(), 0.0F);
    RasterCase few = roomy;
    few.means.resize(3 * kSeen);
    few.scales.resize(3 * kSeen);
    few.rotations.resize(4 * kSeen);
    few.opacities.resize(kSeen);
    few.sh.resize(3 * few.sh_coefficients * kSeen);
    const Results whole =
        results_of(context(), few, with_gradients(raster_desc(few, kRasterModes[1])));
    const Results parts =
        results_of(context(), roomy, with_gradients(raster_desc(roomy, kRasterModes[1])));
    ASSERT_EQ(parts.stats.runs, 1U);
    EXPECT_EQ(parts.stats.pairs, whole.stats.pairs);
    EXPECT_GT(whole.stats.pairs, 4 * kSeen) << "the lists are short";
#if SPLAT_FAULT_POINTS
    for (const int pass : {0, 1}) {
        EXPECT_GE(parts.submits[pass], whole.submits[pass] + 2) << pass;
        std::printf("%llu submits, %llu in parts\n",
                    static_cast<unsigned long long>(whole.submits[pass]),
                    static_cast<unsigned long long>(parts.submits[pass]));
    }
#endif
    EXPECT_EQ(parts.image, whole.image);
    EXPECT_EQ(parts.normals, whole.normals);
    const auto first = [](const std::vector<float>& all, std::size_t from, std::size_t count) {
        const auto at = all.begin() + static_cast<std::ptrdiff_t>(from);
        return std::vector<float>(at, at + static_cast<std::ptrdiff_t>(count));
    };
    const std::size_t n = roomy.count();
    EXPECT_EQ(first(parts.gradients, 0, 12 * kSeen), first(whole.gradients, 0, 12 * kSeen));
    EXPECT_EQ(first(parts.gradients, 12 * n, 12 * kSeen),
              first(whole.gradients, 12 * kSeen, 12 * kSeen));
    EXPECT_EQ(first(parts.exported, 0, 12 * kSeen), whole.exported);
}

}  // namespace
}  // namespace splat::test
