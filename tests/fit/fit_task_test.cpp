#include "fit/fit_task.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <thread>

#include "core/fault.h"
#include "fit/blob_photographs.h"
#include "io/file.h"
#include "io/image.h"
#include "io/weights_file.h"
#include "ref/images/srgb_ref.h"
#include "run/run.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;
using Mode = run::RunFolder::Mode;

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
            if (event.warning) warnings_ += event.text + "\n";
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
    std::string warnings_;
};

TEST_F(FitTask, LearnsWhatItDoesNotSee) {
    const auto run = need(open("run", desc(400)));
    const run::Event end = go(*run);
    EXPECT_EQ(end.kind, run::EventKind::kDone);
    EXPECT_EQ(end.step, 400);
    EXPECT_GT(psnr_, 24);
}

/// A fit's scene has the scores of the fit's last validation.
TEST_F(FitTask, ItsSceneScoresAlike) {
    auto task = std::make_unique<fit::FitTask>(context_, desc(60));
    fit::FitTask& fit = *task;
    const auto run = need(run::Run::open({(folder_ / "run").string(), Mode::kNew, "test"},
                                         std::move(task), interrupt_));
    go(*run);
    fit::SceneScoresDesc what;
    what.data = *desc(60).data;
    what.border = 0.1;
    const scene::Gaussians scene = need(fit.scene());
    const auto scores = need(fit::SceneScores::open(context_, what, scene, interrupt_));
    std::vector<std::string> names;
    run::Event event, validation;
    while (event.kind < run::EventKind::kDone) {
        ASSERT_OK(scores->next(event));
        if (event.kind == run::EventKind::kValidatedPiece) names.push_back(event.validated.name);
        if (event.kind == run::EventKind::kValidation) validation = event;
    }
    EXPECT_EQ(names, (std::vector<std::string>{"images/00.png", "images/08.png"}));
    ASSERT_EQ(validation.numbers.size(), 6);
    const run::Figures figures = run->figures();
    EXPECT_NEAR(validation.numbers[0].value, figures.validation_psnr, 1e-3);
    EXPECT_NEAR(validation.numbers[1].value, figures.validation_ssim, 1e-5);
    // The blobs lie in the middle, where there are more errors.
    EXPECT_STREQ(validation.numbers[2].name, "inner_psnr");
    EXPECT_LT(validation.numbers[2].value, figures.validation_psnr);
    EXPECT_GT(validation.numbers[2].value, figures.validation_psnr - 3);

    what.photos.test_every = 0;  // all photographs
    EXPECT_OK(need(fit::SceneScores::open(context_, what, scene, interrupt_))->next(event));
    EXPECT_EQ(event.pieces, kViews);
    what.border = 0.5;
    EXPECT_ERROR(fit::SceneScores::open(context_, what, scene, interrupt_), Code::kInvalidArgument,
                 "border is 0.5");
    what.border = 0;
    EXPECT_ERROR(fit::SceneScores::open(context_, what, {}, interrupt_), Code::kInvalidArgument,
                 "no Gaussians");
}

/// Linear colours are blended as others are, then converted.
TEST_F(FitTask, ScenesAreScoredAsTheirFilesSay) {
    fit::SceneScoresDesc what;
    what.data = *desc(10).data;
    const auto drawn = [&](const scene::DrawnAs& drawn_as) {
        scene::Gaussians scene = blobs();
        scene.drawn_as = drawn_as;
        const auto scores = need(fit::SceneScores::open(context_, what, scene, interrupt_));
        run::Event event;
        while (event.kind != run::EventKind::kValidatedPiece) {
            EXPECT_OK(scores->next(event));
            if (event.kind >= run::EventKind::kDone) break;
        }
        return event.validated.images;
    };
    const std::vector<float> plain = drawn({});
    EXPECT_NE(drawn({.antialiased = true}), plain);
    EXPECT_NE(drawn({.three_sigma = true}), plain);
    const std::vector<float> converted = drawn({.linear_colors = true});
    ASSERT_EQ(converted.size(), plain.size());
    for (std::size_t i = 0; i < plain.size(); ++i)
        EXPECT_NEAR(static_cast<double>(converted[i]),
                    ref::srgb_of_linear(static_cast<double>(plain[i])), 1e-6);
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

TEST_F(FitTask, McmcHasItsBudgetAndResumesWithTheSameBits) {
    fit::FitDesc mcmc = desc(110);
    mcmc.values = {"strategy=mcmc", "growth_every=20"};
    go(*need(open("whole", mcmc)));
    EXPECT_GT(psnr_, 18);
    const io::WeightsFile file =
        need(io::load_weights((folder_ / "whole/gaussians_last.safetensors").string()));
    const io::NamedTensor* const means = file.tensors.find("means");
    ASSERT_NE(means, nullptr);
    EXPECT_EQ(means->dims[0], 2000);
    for (const io::NamedTensor& tensor : file.tensors)
        for (const float value : tensor.values) EXPECT_TRUE(std::isfinite(value)) << tensor.name;
    go(*need(open("parts", mcmc)), 50);
    go(*need(open("parts", {}, Mode::kResume)), 75);
    go(*need(open("parts", {}, Mode::kResume)));
    EXPECT_EQ(result("parts"), result("whole"));
}

/// A tile without a valid pixel has no gradient, so that it need not be drawn.
TEST_F(FitTask, TilesWithoutPixelsChangeNoBit) {
    std::vector<float> mask(std::size_t{kWidth} * kHeight, 1);
    for (std::size_t i = 0; i < mask.size(); ++i)
        if (i % kWidth > 20 && i / kWidth < 40) mask[i] = 0;
    for (std::uint32_t view = 0; view < kViews; ++view)
        put_png(folder_ / format("masks/%02u.png", view),
                io::image_from_floats(mask, kWidth, kHeight, 1));
    fit::FitDesc masked = desc(12);
    masked.masks = (folder_ / "masks").string();
    masked.values = {"skip_sizes=false"};
    go(*need(open("with", masked)));
    masked.values.push_back("skip_tiles=false");
    go(*need(open("without", masked)));
    EXPECT_TRUE(result("with") == result("without"));
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

TEST_F(FitTask, MemoryIsEstimatedBeforeTheFirstStep) {
    context_ = make_context();
    fit::FitDesc large = desc(12);
    large.max_gaussians = 150000;
    go(*need(open("run", large)));
    const std::string text = file_text(folder_ / "run/run.json");
    const JsonTree json = parse_json_tree(text, "run.json").value();
    const auto estimated = static_cast<double>(*json["estimated_bytes"]["device"].count());
    const auto peak = static_cast<double>(context_->memory().use().peak);
    EXPECT_GT(peak, 2e8);
    EXPECT_GT(estimated, 0.97 * peak) << text;
    EXPECT_LT(estimated, 1.3 * peak);
    EXPECT_HAS(file_text(folder_ / "run/log.txt"), "of the device: photographs 0 MB, Gaussians ");
}

TEST_F(FitTask, KeepsToItsMemory) {
    constexpr std::uint64_t kBound = 120'000'000;
    context_ = make_context();
    fit::FitDesc bound = desc(20);
    bound.max_gaussians = 150000;
    bound.memory = kBound;
    go(*need(open("whole", bound)));
    EXPECT_LE(context_->memory().use().peak, kBound);
    EXPECT_GT(context_->memory().use().peak, kBound * 3 / 5);
    EXPECT_HAS(warnings_, "Gaussians instead of 150000, for which 120 MB are too little memory");
    go(*need(open("parts", bound)), 9);
    bound.memory = 2 * kBound;  // what the fit was cut to stays
    go(*need(open("parts", bound, Mode::kResume)));
    EXPECT_EQ(result("parts"), result("whole"));
    // What the first one wrote repeats it, too.
    const JsonTree json =
        parse_json_tree(file_text(folder_ / "whole/config.json"), "config").value();
    for (const char* name : {"memory_gaussians", "memory_downscale"})
        bound.values.push_back(format("%s=%llu", name, llu(*json[name].count())));
    go(*need(open("again", bound)));
    EXPECT_EQ(result("again"), result("whole"));
    bound.values = {"memory_downscale=59"};
    EXPECT_ERROR(open("smaller", bound), Code::kInvalidArgument,
                 "memory_downscale is 59, expected at most 58, the shorter side of 'images/");
    bound.values = {};
    bound.memory = 10'000'000;
    EXPECT_ERROR(open("small", bound), Code::kOutOfDeviceMemory, "but has 10 MB: allow more");
    EXPECT_FALSE(fs::exists(folder_ / "small"));
}

#if SPLAT_FAULT_POINTS
/// Memory that is not there when Gaussians are rearranged, and when views are drawn.
TEST_F(FitTask, GoesOnWhereMemoryRunsOut) {
    context_ = make_context(context_desc(vk::Kernels::kAuto, Bounds::kExact));
    fit::FitDesc whole = desc(230);
    whole.values = {"growth_every=100"};
    const auto run = need(open("whole", whole));
    go(*run, 100);
    fault::arm("vk.allocate_memory", 1, 2);
    go(*run, 101);
    EXPECT_EQ(fault::disarm() > 2, true);
    const std::string told = warnings_;
    EXPECT_HAS(told, "step 101: memory runs out: from here on there are at most 2");
    EXPECT_HAS(told, "; memory runs out: from here on a step draws one view");
    go(*run);
    EXPECT_EQ(warnings_, told) << "told once";
    EXPECT_GT(psnr_, 20);
    // A state after it knows: the rest has the same bits without any lack.
    fs::copy(folder_ / "whole", folder_ / "rest", fs::copy_options::recursive);
    fs::remove(folder_ / "rest/checkpoints/step_0000000230.state.safetensors");
    go(*need(open("rest", {}, Mode::kResume)));
    EXPECT_EQ(result("rest"), result("whole"));
    // Where nothing is left to spare, the step fails, and is done later.
    const auto poor = need(open("poor", desc(20)));
    fault::arm("vk.allocate_memory", 1);
    run::Event event;
    Status failed;
    while (failed.ok() && event.kind < run::EventKind::kDone) failed = poor->next(event);
    fault::disarm();
    EXPECT_ERROR(failed, Code::kOutOfDeviceMemory, "the run can be resumed where there is more");
    go(*poor);
    // A view that is only scored does with less by itself.
    const auto scored = need(open("scored", desc(20)));
    do ASSERT_OK(scored->next(event));
    while (event.kind != run::EventKind::kCheckpoint);
    fault::arm("vk.allocate_memory", 1, 1);
    ASSERT_OK(scored->next(event));
    EXPECT_EQ(event.kind, run::EventKind::kValidatedPiece);
    EXPECT_GT(fault::disarm(), 1U);
    go(*scored);
    EXPECT_EQ(warnings_, told) << "steps lack nothing";
    EXPECT_EQ(result("scored"), result("poor"));
}
#endif

/// A block counts where all of its pixels do.
TEST_F(FitTask, LeavesOutPhotographsThatMemoryLeavesNoPixel) {
    for (std::uint32_t view = 0; view < kViews; ++view) {
        std::vector<float> mask(std::size_t{kWidth} * kHeight, 1);
        for (std::size_t i = 0; i < mask.size(); ++i)
            if ((view == 5 || view == 8) && i % kWidth % 2 == 0) mask[i] = 0;
        put_png(folder_ / format("masks/%02u.png", view),
                io::image_from_floats(mask, kWidth, kHeight, 1));
    }
    fit::FitDesc striped = desc(3);
    striped.masks = (folder_ / "masks").string();
    striped.values = {"memory_downscale=2"};
    go(*need(open("run", striped)));
    EXPECT_HAS(file_text(folder_ / "run/log.txt"),
               "2 of 16 photographs have no pixel that counts at 1/2 of their sides, such as "
               "'images/05.png', and are left out");
    EXPECT_HAS(file_text(folder_ / "run/log.txt"), "13 photographs, 1 held out");
}

TEST_F(FitTask, IsCancelledWhileItIsOpened) {
    // A machine with other work may let no raise fall into an attempt of some milliseconds.
    const auto cancelled = [&](const std::function<Status()>& attempt) {
        std::atomic<bool> done = false;
        std::thread other([&] {
            while (!done) context_->mutex.interrupt().raise();
        });
        Status status;
        for (int i = 0; i < 100 && status.ok(); ++i) status = attempt();
        done = true;
        other.join();
        return status;
    };
    EXPECT_ERROR(cancelled([&] {
                     fs::remove_all(folder_ / "run");
                     return open("run", desc(10)).status();
                 }),
                 Code::kCancelled, "splat_device_cancel");
    EXPECT_FALSE(fs::exists(folder_ / "run"));
    EXPECT_OK(open("run", desc(10)));
    fit::SceneScoresDesc what;
    what.data = *desc(10).data;
    const auto score = [&] {
        return fit::SceneScores::open(context_, what, blobs(), interrupt_).status();
    };
    EXPECT_ERROR(cancelled(score), Code::kCancelled, "splat_device_cancel");
    EXPECT_OK(score());
}

/// Means that leave the range of float32.
TEST_F(FitTask, AStepThatDivergedUpdatesNothing) {
    const data::PosedPhotos loaded =
        need(data::load_posed_photos((folder_ / "photos").string(), {}));
    std::vector<scene::Camera> cameras;
    for (const data::PosedPhoto& photo : loaded.photos) cameras.push_back(photo.camera);
    const fit::ScheduleDesc schedule{
        .gaussians = 500, .most_gaussians = 500, .pixels = kWidth * kHeight, .extent = 1e41};
    const auto fitter = need(fit::Fitter::create(
        *context_, {.photos = loaded.photos, .schedule = fit::Schedule::of_steps(schedule, 20)}));
    ASSERT_OK(
        fitter->begin(need(fit::first_gaussians(fit::random_points(cameras, 500, 0), 500, 0))));
    fit::FitStep done;
    ASSERT_OK(fitter->step(0, 0, done));
    EXPECT_FALSE(done.skipped);
    ASSERT_OK(fitter->step(1, 1, done));
    EXPECT_TRUE(done.skipped);
    EXPECT_TRUE(std::isfinite(done.loss));
    EXPECT_GT(done.drawn.non_finite, 0U);
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
