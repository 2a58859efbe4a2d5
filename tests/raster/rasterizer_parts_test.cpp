// Lists that are walked in parts, one a dispatch, give the bits of lists that are walked at once.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <ctime>

#include "ops/op_harness.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/gpu_buffers.h"
#include "support/parsed_json.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kLeastPart = 256;

/// While it lives, the kernels of blending count as so slow that parts are as short as they may be.
class ShortParts {
  public:
    explicit ShortParts(vk::Context& context) : pace_(context.device().pace) {
        for (const char* kernel : kKernels) {
            before_.push_back(pace_.of(kernel).factor);
            pace_.of(kernel).factor = 1e9;
        }
        EXPECT_EQ(raster::part_entries(context, false), kLeastPart);
        EXPECT_EQ(raster::part_entries(context, true), kLeastPart);
    }
    ~ShortParts() {
        for (std::size_t i = 0; i < before_.size(); ++i) pace_.of(kKernels[i]).factor = before_[i];
    }
    ShortParts(const ShortParts&) = delete;
    ShortParts& operator=(const ShortParts&) = delete;

  private:
    static constexpr const char* kKernels[] = {"blend_forward",      "blend_forward_cpu",
                                               "blend_forward_gpu",  "blend_backward",
                                               "blend_backward_cpu", "blend_backward_gpu"};
    vk::Pace& pace_;
    std::vector<double> before_;
};

class RasterizerParts : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(RasterizerParts);

/// Most Gaussians reach every tile. Pixels stop after a few hundred entries, or later if `faint`.
RasterCase layers(const SceneSize& size, bool faint) {
    RasterCase scene = random_scene(size, 97, 1);
    Rng rng(98);
    for (std::size_t i = 0; i < scene.scales.size(); ++i)
        scene.scales[i] = static_cast<float>(i / 3 % 4 == 3 ? 0.2 : 2 + rng.uniform());
    for (float& opacity : scene.opacities)
        opacity = static_cast<float>((faint ? 0.005 : 0.02) * (1 + rng.uniform()));
    scene.name = faint ? "faint layers" : "layers";
    return scene;
}

raster::RasterDesc all_outputs(const RasterCase& scene, const RasterMode& mode) {
    raster::RasterDesc desc = with_gradients(raster_desc(scene, mode));
    desc.grad_intrinsics = true;
    desc.ids = true;
    return desc;
}

/// Everything that a forward call and the second of two backward calls wrote.
std::vector<float> results_of(vk::Context& context, RasterSession& session,
                              std::span<const scene::Camera> cameras) {
    EXPECT_OK(session.forward(cameras));
    const raster::RasterDesc& desc = session.rasterizer().desc();
    for (int call = 0; call < 2 && desc.backward; ++call)
        EXPECT_OK(
            session.backward(normal_fill(4 * desc.pixels(), 1), normal_fill(desc.pixels(), 2)));
    const raster::Workspace& space = session.rasterizer().workspace();
    std::vector<float> all = session.image();
    const auto add = [&](const std::vector<float>& more) {
        all.insert(all.end(), more.begin(), more.end());
    };
    if (desc.backward) add(session.gradients());
    if (desc.export_gradients) add(session.exported());
    if (desc.grad_pose) {
        add(download(context, space.pose.range(), std::uint64_t{12} * desc.views));
        add(download(context, space.intrinsics.range(), std::uint64_t{4} * desc.views));
    }
    if (desc.extra) add(download(context, space.extra.range(), 4 * desc.pixels()));
    if (desc.median) add(download(context, space.median.range(), desc.pixels()));
    if (desc.normals) add(download(context, space.normal_image.range(), 4 * desc.pixels()));
    if (desc.contributions) add(download(context, space.contributions.range(), 2 * desc.gaussians));
    return all;
}

void expect_same_in_parts(vk::Context& context, const RasterCase& scene,
                          const raster::RasterDesc& desc, std::span<const scene::Camera> cameras,
                          std::uint32_t least_passes = 1) {
    SCOPED_TRACE(scene.name);
    const auto draw = [&](std::uint32_t entries) {
        RasterSession session(context, scene, desc);
        EXPECT_OK(session);
        if (!session.status().ok()) return std::vector<float>();
        EXPECT_GE(raster::part_entries(context, true), entries);
        std::vector<float> all = results_of(context, session, cameras);
        const raster::RasterStats& stats = session.rasterizer().stats();
        EXPECT_GT(stats.longest, 2 * kLeastPart);
        EXPECT_GE(stats.passes, least_passes);
        EXPECT_LE(stats.longest, 1024U) << "walked at once otherwise";
        return all;
    };
    const std::vector<float> whole = draw(1024);
    const ShortParts parts(context);
    EXPECT_EQ(draw(kLeastPart), whole);
}

TEST_P(RasterizerParts, GiveTheSameBits) {
    const bool cpu = GetParam() == vk::Kernels::kCpu;  // other kernels take seconds
    for (const bool faint : {false, true}) {
        const RasterCase scene =
            layers(cpu ? SceneSize{850, 40, 24} : SceneSize{600, 20, 16}, faint);
        const scene::Camera camera = camera_of(scene);
        raster::RasterDesc desc = all_outputs(scene, kRasterModes[faint ? 1 : 0]);
        desc.original_gradient = !faint;
        if (faint) {
            desc.skips.early_out = desc.skips.blocks = desc.extra = desc.ids = desc.normals = false;
            desc.contributions = desc.export_gradients = desc.grad_depth = false;
        }
        expect_same_in_parts(context(), scene, desc, {&camera, 1});
    }
}

TEST_P(RasterizerParts, RayMaximum) {
    const RasterCase scene = layers({600, 20, 16}, false);
    raster::RasterDesc desc = raster_desc(scene, kRayModes[0]);
    desc.ids = true;
    const scene::Camera camera = camera_of(scene);
    expect_same_in_parts(context(), scene, desc, {&camera, 1});
}

TEST_P(RasterizerParts, ViewsOfTheirOwnSizes) {
    const RasterCase scene = layers({600, 20, 24}, false);
    std::vector<scene::Camera> cameras(2, camera_of(scene));
    cameras[1].world_to_camera[3] += 0.2;
    cameras[1].width = 15;
    cameras[1].height = 17;
    raster::RasterDesc desc = all_outputs(scene, kRasterModes[1]);
    desc.views = 2;
    expect_same_in_parts(context(), scene, desc, cameras);
}

/// A binding holds the records of one of three rows of tiles, or two.
TEST_P(RasterizerParts, GroupsOfTileRows) {
    const RasterCase scene = layers({700, 32, 48}, true);
    const bool cpu = GetParam() == vk::Kernels::kCpu;
    vk::ContextDesc desc = context_desc(GetParam());
    desc.device.fake = [cpu](vk::DeviceInfo& info) {
        info.limits.max_storage_buffer_bytes = 700 * (cpu ? 52 : 128);
    };
    const auto narrow = make_context(desc);
    const scene::Camera camera = camera_of(scene);
    expect_same_in_parts(*narrow, scene, all_outputs(scene, kRasterModes[1]), {&camera, 1}, 2);
}

/// Lists of one, three and four parts, then of one again.
TEST_P(RasterizerParts, FollowListsThatGrow) {
    const RasterCase scene = layers({850, 20, 16}, false);
    const raster::RasterDesc desc = all_outputs(scene, kRasterModes[1]);
    const scene::Camera camera = camera_of(scene);
    const ShortParts parts(context());
    RasterSession session(context(), scene, desc);
    ASSERT_OK(session);
    std::vector<std::uint64_t> lengths;
    for (const std::size_t seen : {200, 600, 850, 200}) {
        RasterCase part = scene;
        std::fill(part.opacities.begin() + static_cast<std::ptrdiff_t>(seen), part.opacities.end(),
                  0.0F);
        const auto packed = need(PackedCase::create(context(), part, desc));
        const auto values = download(context(), packed.scene.gaussians.range(), 12 * part.count());
        ASSERT_OK(
            context().write(session.scene().gaussians.range(), values.data(), 4 * values.size()));
        RasterSession fresh(context(), part, desc);
        ASSERT_OK(fresh);
        EXPECT_EQ(results_of(context(), session, {&camera, 1}),
                  results_of(context(), fresh, {&camera, 1}))
            << seen;
        lengths.push_back(session.rasterizer().stats().longest);
    }
    EXPECT_LE(lengths[0], kLeastPart);
    EXPECT_GT(lengths[1], kLeastPart);
    EXPECT_GT(lengths[2], lengths[1] + kLeastPart / 2);
    EXPECT_EQ(lengths[3], lengths[0]);
}

/// ctest runs these on one thread of lavapipe.
class RasterizerPartsFull : public RasterizerParts {};
SPLAT_INSTANTIATE_KERNELS(RasterizerPartsFull);

/// Submits cut anywhere give the bits of one submit, and each is as short as it must be by its estimate.
TEST_P(RasterizerPartsFull, ShortSubmitsGiveTheSameBits) {
    const bool cpu = GetParam() == vk::Kernels::kCpu;
    const RasterCase scene =
        random_scene(cpu ? SceneSize{4000, 160, 100} : SceneSize{2000, 48, 32}, 96, 1);
    const scene::Camera camera = camera_of(scene);
    const raster::RasterDesc rasterizer = all_outputs(scene, kRasterModes[1]);
    std::vector<float> results[2];
    vk::ContextDesc desc = context_desc(GetParam());
    // A part of 256 entries takes plain kernels 5.2 ms, by their estimate.
    desc.device.max_submit_ns = GetParam() == vk::Kernels::kPlain ? 6'000'000 : 2'000'000;
    const auto device = make_context(desc);
    for (const bool brief : {false, true}) {
        vk::Context& used = brief ? *device : context();
        RasterSession session(used, scene, rasterizer);
        ASSERT_OK(session);
        results[brief] = results_of(used, session, {&camera, 1});
    }
    const vk::Pace& pace = device->device().pace;
    if (!pace.watched()) {
        EXPECT_LE(pace.longest_estimate(), pace.submit_seconds());
    }
    EXPECT_EQ(results[1], results[0]);
}

/// Time of the process on all CPUs, for which other processes do not count.
std::chrono::steady_clock::time_point cpu_time() {
    timespec time{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return std::chrono::steady_clock::time_point(std::chrono::seconds(time.tv_sec) +
                                                 std::chrono::nanoseconds(time.tv_nsec));
}

/// A million Gaussians reach every pixel of the only tile, and no walk ends early: seconds of work.
TEST_P(RasterizerPartsFull, NoSubmitIsLong) {
    const bool cpu = GetParam() == vk::Kernels::kCpu;
    RasterCase scene = layers({cpu ? 1000000U : 20000U, 16, 16}, true);
    scene.scales.assign(scene.scales.size(), 5);
    vk::ContextDesc desc = context_desc(GetParam());
    desc.profile = true;
    desc.device.max_submit_ns = 50'000'000;
    const auto device = make_context(desc);
    device->device().pace.now = cpu_time;
    raster::RasterDesc to_draw = raster_desc(scene, kRasterModes[1]);
    to_draw.backward = true;
    to_draw.extra = to_draw.normals = to_draw.skips.early_out = false;
    RasterSession session(*device, scene, to_draw);
    ASSERT_OK(session);
    const auto gradients = need(PackedCase::create(*device, scene, to_draw)).gradients;
    const vk::Buffer grad_image = upload(*device, normal_fill(4 * scene.pixels(), 1));
    double best = 1e9;
    for (int call = 0; call < 8 && best > 100; ++call) {
        device->profile()->reset();
        ASSERT_OK(session.forward());
        ASSERT_OK(session.rasterizer().backward(grad_image.range(), grad_image.range(),
                                                gradients.views()));
        const Json lists = need(parse_json(device->profile()->json(""), "profile"))["lists"];
        const double longest = lists["longest_submit_ms"].get<double>();
        std::printf("%s: %.1f ms in %d submits, the longest %.1f ms; then parts of %u and %u\n",
                    vk::kernels_name(GetParam()), lists["device_ms"].get<double>(),
                    lists["submits"].get<int>(), longest, raster::part_entries(*device, false),
                    raster::part_entries(*device, true));
        if (call > 1) best = std::min(best, longest);
    }
    EXPECT_EQ(session.rasterizer().stats().longest, scene.count());
    EXPECT_LE(best, 100);
}

}  // namespace
}  // namespace splat::test
