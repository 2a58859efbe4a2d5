#include "fit/fit_task.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <thread>

#include "io/file.h"
#include "io/image.h"
#include "io/transforms_json.h"
#include "run/run.h"
#include "scene/arrays.h"
#include "scene/orbit.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/rng_fill.h"
#include "synthetic/sample_folder.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;
using Mode = run::RunFolder::Mode;

constexpr std::uint32_t kViews = 16, kWidth = 75, kHeight = 58;  // no multiples of 16

/// Coloured blobs.
scene::Gaussians blobs() {
    constexpr std::size_t kBlobs = 60;
    scene::Gaussians scene = scene::make_gaussians(kBlobs, 0);
    scene.means = normal_fill(3 * kBlobs, 1);
    scene.log_scales = normal_fill(3 * kBlobs, 2, -1.5, 0.3);
    scene.rotations = normal_fill(4 * kBlobs, 3);
    scene.opacity_logits = normal_fill(kBlobs, 4, 2, 0.5);
    scene.sh = normal_fill(3 * kBlobs, 5);
    return scene;
}

/// Photographs of the blobs with their cameras, as a transforms.json names them.
void write_photographs(const fs::path& folder) {
    vk::Context* const context = shared_context();
    const scene::Gaussians scene = blobs();
    std::vector<scene::Camera> cameras =
        scene::orbit(scene, {.count = kViews, .width = kWidth, .height = kHeight}).value();
    raster::RasterDesc desc;
    desc.gaussians = static_cast<std::uint32_t>(scene.count());
    desc.width = kWidth;
    desc.height = kHeight;
    desc.convention = raster::Convention::kGsplat;
    const auto rasterizer = need(raster::Rasterizer::create(*context, desc));
    gaussians::GaussianSet set = need(gaussians::allocate_set(*context, desc));
    ASSERT_OK(gaussians::upload(*context, scene, set));
    for (std::size_t i = 0; i < cameras.size(); ++i) {
        cameras[i].name = format("images/%02zu.png", i);
        ASSERT_OK(
            rasterizer->forward(set.views(), need(raster::pack_views(desc, {&cameras[i], 1}, {}))));
        std::vector<float> quads(std::size_t{4} * kWidth * kHeight);
        ASSERT_OK(context->read(rasterizer->workspace().image.range(), quads.data(),
                                quads.size() * sizeof(float)));
        std::vector<float> rgb;
        for (std::size_t pixel = 0; pixel < quads.size(); pixel += 4)
            rgb.insert(rgb.end(), &quads[pixel], &quads[pixel] + 3);
        put_png(folder / cameras[i].name, io::image_from_floats(rgb, kWidth, kHeight, 3));
    }
    ASSERT_OK(io::write_file((folder / "transforms.json").string(),
                             need(io::write_transforms_json(cameras))));
}

class FitTask : public testing::Test {
  protected:
    void SetUp() override { write_photographs(folder_ / "photos"); }

    [[nodiscard]] fit::FitDesc desc(std::uint64_t steps) const {
        fit::FitDesc desc;
        desc.data = (folder_ / "photos").string();
        if (steps > 0) desc.steps = steps;
        desc.max_gaussians = 2000;
        return desc;
    }
    Result<std::unique_ptr<run::Run>> open(const char* name, const fit::FitDesc& desc,
                                           Mode mode = Mode::kNew) {
        return run::Run::open({(folder_ / name).string(), mode, "test"},
                              std::make_unique<fit::FitTask>(context_, desc), interrupt_);
    }
    /// To its end, or to `stop_after` steps, as a kill would.
    run::Event go(run::Run& run, std::uint64_t stop_after = ~std::uint64_t{0}) {
        run::Event event;
        while (event.kind < run::EventKind::kDone) {
            EXPECT_OK(run.next(event));
            if (event.kind == run::EventKind::kValidation) psnr_ = event.numbers[0].value;
            if (event.kind == run::EventKind::kStep && event.step >= stop_after) break;
        }
        return event;
    }
    std::string result(const char* name) {
        return file_text(folder_ / name / "gaussians_last.safetensors");
    }

    SampleFolder folder_;
    std::shared_ptr<vk::Context> context_{std::shared_ptr<void>(),
                                          shared_context()};  ///< not owned
    Interrupt interrupt_;
    double psnr_ = 0;
};

TEST_F(FitTask, LearnsWhatItDoesNotSee) {
    const auto run = need(open("run", desc(400)));
    const run::Event end = go(*run);
    EXPECT_EQ(end.kind, run::EventKind::kDone);
    EXPECT_EQ(end.step, 400);
    EXPECT_GT(psnr_, 24);
}

TEST_F(FitTask, ResumesWithTheSameBits) {
    go(*need(open("whole", desc(230))));
    const std::string whole = result("whole");
    // States are saved every 46 steps; growth comes at 100 and 200.
    go(*need(open("parts", desc(230))), 120);
    fit::FitDesc rest;
    go(*need(open("parts", rest, Mode::kResume)), 205);
    go(*need(open("parts", rest, Mode::kResume)));
    EXPECT_EQ(result("parts"), whole);
    go(*need(open("again", desc(230))));
    EXPECT_EQ(result("again"), whole);
    fit::FitDesc seeded = desc(230);
    seeded.seed = 1;
    go(*need(open("seeded", seeded)));
    EXPECT_NE(result("seeded"), whole);
}

TEST_F(FitTask, RefusesToGoOnWithOtherData) {
    go(*need(open("run", desc(20))), 10);
    fit::FitDesc other;
    other.steps = 30;
    EXPECT_ERROR(open("run", other, Mode::kResume), Code::kInvalidArgument,
                 "steps differs from that of the run");
    other = {};
    other.downscale = 2;
    EXPECT_ERROR(open("run", other, Mode::kResume), Code::kInvalidArgument, "downscale differs");
    other = desc(20);  // what the run has
    EXPECT_OK(open("run", other, Mode::kResume).status());
    // One sample of one photograph.
    const std::string path = (folder_ / "photos/images/03.png").string();
    io::Image image = need(io::read_png(need(io::read_file(path, 1 << 20))));
    image.samples[7] ^= 1;
    put_png(path, image);
    EXPECT_ERROR(open("run", fit::FitDesc(), Mode::kResume), Code::kInvalidArgument,
                 "have changed since the run began");
}

TEST_F(FitTask, RefusesOptionsThatMeanNothing) {
    fit::FitDesc bad = desc(10);
    bad.seconds = 3;
    EXPECT_ERROR(open("bad", bad), Code::kInvalidArgument, "seconds is 3 and steps 10");
    bad = desc(10);
    bad.seed = ~std::uint64_t{0};
    EXPECT_ERROR(open("bad", bad), Code::kInvalidArgument, "seed is 18446744073709551615");
    bad = desc(std::uint64_t{1} << 40);
    EXPECT_ERROR(open("bad", bad), Code::kInvalidArgument, "steps is 1099511627776");
    bad = desc(10);
    bad.max_gaussians = 4000000;
    EXPECT_ERROR(open("bad", bad), Code::kUnsupported, "but the device takes at most");
    EXPECT_FALSE(fs::exists(folder_ / "bad"));
}

/// A call that is cancelled while Gaussians are updated or rearranged does all of it or nothing.
TEST_F(FitTask, CancelledCallsChangeNoBit) {
    go(*need(open("whole", desc(110))));
    const auto run = need(open("cancelled", desc(110)));
    run::Event event;
    std::size_t cancelled = 0;
    while (event.kind < run::EventKind::kDone) {
        std::thread other([&] {
            std::this_thread::sleep_for(std::chrono::milliseconds(event.step % 7));
            context_->mutex.interrupt().raise();
        });
        const Status done = run->next(event);
        other.join();
        if (!done.ok()) {
            EXPECT_EQ(done.code(), Code::kCancelled) << done.message();
            ++cancelled;
            EXPECT_OK(run->next(event));
        }
    }
    EXPECT_GT(cancelled, 0);
    EXPECT_EQ(result("cancelled"), result("whole"));
}

TEST_F(FitTask, SecondsBecomeSteps) {
    fit::FitDesc timed = desc(0);
    timed.seconds = 0.5;
    go(*need(open("timed", timed)));
    const std::string config = file_text(folder_ / "timed/config.json");
    const JsonTree json = parse_json_tree(config, "config").value();
    ASSERT_TRUE(json["steps"].count());
    const std::uint64_t steps = *json["steps"].count();
    EXPECT_GE(steps, 1);
    go(*need(open("repeated", desc(steps))));
    EXPECT_EQ(result("repeated"), result("timed"));
}

}  // namespace
}  // namespace splat::test
