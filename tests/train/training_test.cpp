#include "train/splatter_training.h"

#include <algorithm>
#include <thread>

#include "core/fault.h"
#include "io/image.h"
#include "train/training_fixture.h"

namespace splat::train {
namespace {

TEST_F(TrainingTest, GivesItsWorkPieceByPiece) {
    const auto training = open(desc("run"));
    EXPECT_TRUE(fs::exists(folder_.path() / "run/config.json"));
    const std::vector<Event> events = run(*training);
    EXPECT_EQ(kinds_of(events), ".covsscovsscovd") << "a state and a validation before step 1";
    EXPECT_HAS(events[0].text, "training ");
    const Event* const step = first_of(events, EventKind::kStep);
    EXPECT_EQ(step->step, 1U);
    EXPECT_GT(number_of(*step, "loss"), 0);
    EXPECT_GT(number_of(*step, "psnr"), 1);
    EXPECT_TRUE(step->logged);
    EXPECT_GT(step->peak_bytes, 0U);
    const Event* const object = first_of(events, EventKind::kValidatedPiece);
    EXPECT_EQ(object->validated.images.size(), std::size_t{4} * 3 * 16 * 16);
    EXPECT_EQ(object->validated.truths.size(), object->validated.images.size());
    EXPECT_EQ(object->validated.inputs, 1U);
    EXPECT_EQ(number_of(*first_of(events, EventKind::kValidation), "val_psnr"),
              number_of(*object, "val_psnr"));
    EXPECT_EQ(events.back().text.substr(0, 14), "done: 4 steps,");
    EXPECT_EQ(training->figures().step, 4U);
    Event again;
    ASSERT_OK(training->next(again));
    EXPECT_EQ(again.kind, EventKind::kDone);
    EXPECT_HAS(file("run", "run.json"), "\"state\": \"done\"");
    EXPECT_HAS(file("run", "log.txt"), "validation PSNR");
}

/// Each line of a step, and the reports, tell what was drawn and finite, and the line the rate.
TEST_F(TrainingTest, KeepsALedger) {
    const Asked asked = desc("run");
    const auto training = open(asked);
    EXPECT_HAS(file("run", "run.json"), "\"ledger\": null");
    const std::vector<Event> events = run(*training);
    const Event* const first = first_of(events, EventKind::kStep);
    EXPECT_EQ(number_of(*first, "rate"), training->training->settings().training.rate(1));
    std::vector<const Event*> steps;
    for (const Event& event : events)
        if (event.kind == EventKind::kStep) steps.push_back(&event);
    ASSERT_EQ(steps.size(), 4U);
    const auto counts = [](const Event& step, const char* colon, const char* comma) {
        return format(
            "\"visible\"%s%.0f%s\"culled\"%s%.0f%s\"non_finite\"%s0%s\"gradients_zero\"%sfalse}",
            colon, number_of(step, "visible"), comma, colon, number_of(step, "culled"), comma,
            colon, comma, colon);
    };
    const std::string metrics = file("run", "metrics.jsonl");
    EXPECT_HAS(metrics, counts(*steps[0], ":", ","));
    EXPECT_HAS(metrics, counts(*steps[3], ":", ","));
    EXPECT_HAS(metrics, format("\"rate\":%.17g,", number_of(*first, "rate")));
    const std::string last = "\"ledger\": {" + counts(*steps[3], ": ", ", ");
    EXPECT_HAS(file("run", "run.json"), last);
    EXPECT_HAS(figures_json(training->figures()), last);
}

TEST_F(TrainingTest, IsInterruptedFromAnotherThread) {
    run(*open(desc("whole")));
    {
        const auto training = open(desc("parts", {"opt.iterations=100000"}));
        std::thread other;
        Event event;
        while (event.kind < EventKind::kDone) {
            ASSERT_OK(training->next(event));
            if (event.step == 1 && !other.joinable())
                other = std::thread([&] { interrupt_.raise(); });
        }
        other.join();
        EXPECT_EQ(event.kind, EventKind::kInterrupted);
        EXPECT_HAS(event.text, "interrupted after step");
        EXPECT_LT(event.step, 4U) << "the calls after it do nothing else";
        EXPECT_HAS(file("parts", "run.json"), "\"interrupted\"");
    }
    run(*open(resumed("parts", {"opt.iterations=4"})));
    expect_equal_weights("whole", "parts");
    EXPECT_HAS(file("parts", "log.txt"), "opt.iterations 100000 -> 4");
}

TEST_F(TrainingTest, HasItsFolderForItself) {
    const auto training = open(desc("run"));
    EXPECT_ERROR(refusal(resumed("run")), Code::kInvalidState, "a run of process ");
    Asked over = desc("run");
    over.mode = Mode::kReplace;
    EXPECT_ERROR(refusal(over), Code::kInvalidState, "a run of process ");
    EXPECT_EQ(run(*training).back().kind, EventKind::kDone);
}

TEST_F(TrainingTest, ValidatesOnlyAtTheEndIfAsked) {
    EXPECT_EQ(kinds_of(run(*open(desc("run", {"logging.val_log=0"})))), ".csscsscovd");
    EXPECT_HAS(file("run", "run.json"), "\"val_psnr\": ");
}

/// The data have 51.99 degrees, which data.fov is by default.
TEST_F(TrainingTest, WarnsOfAnotherFieldOfView) {
    const auto texts = [&](const char* name, const char* fov) {
        std::string all;
        Event event;
        const auto training = open(desc(name, {fov}));
        for (bool message = true; training && message;) {
            EXPECT_OK(training->next(event));
            message = event.kind == EventKind::kMessage;
            if (message && event.warning) all += event.text;
        }
        return all;
    };
    EXPECT_EQ(texts("near", "data.fov=52.2"), "");
    EXPECT_EQ(texts("none", "data.fov=0"), "");
    EXPECT_HAS(texts("far", "data.fov=49"), "view is 51.99 degrees, but 'data.fov' is 49");
}

#if SPLAT_FAULT_POINTS
/// A disk that is full for a moment: the next call tells what was done, once.
TEST_F(TrainingTest, TellsAfterAnErrorWhatItDid) {
    const auto training = open(desc("run", {"opt.iterations=3"}));
    std::vector<Event> events;
    std::size_t failed = 0;
    const auto next = [&](const char* fault_point, std::uint64_t at) {
        fault::arm(fault_point, at, 1);
        events.emplace_back();
        const Status status = training->next(events.back());
        fault::disarm();
        if (status.ok()) return;
        ++failed;
        EXPECT_EQ(status.code(), Code::kIo);
        EXPECT_OK(training->next(events.back()));
    };
    for (int i = 0; i < 3; ++i) next("none", 1);
    next("io.write", 2);  // the text of a validation, behind its line of metrics
    EXPECT_EQ(failed, 1U);
    next("none", 1);
    next("io.write", 1);  // the line of step 2
    EXPECT_EQ(failed, 2U);
    EXPECT_EQ(events.back().step, 2U);
    while (events.back().kind < EventKind::kDone) next("none", 1);
    EXPECT_EQ(kinds_of(events), ".covsscovscovd");
    const std::string metrics = file("run", "metrics.jsonl");
    EXPECT_EQ(std::count(metrics.begin(), metrics.end(), '\n'), 6) << metrics;
    EXPECT_HAS(metrics, "{\"step\":2,\"loss\":");
    const std::string log = file("run", "log.txt");
    EXPECT_HAS(log, "step 0: validation");
    EXPECT_EQ(log.find("step 0: validation"), log.rfind("step 0: validation")) << log;
}

#endif

/// Gaussians that are too transparent to be drawn.
TEST_F(TrainingTest, EndsWhereNothingIsDrawn) {
    const auto training = open(desc("run", {"model.opacity_bias=-30", "opt.iterations=1000",
                                            "logging.val_log=0", "logging.ckpt_iterations=0"}));
    const std::vector<Event> events = run(*training);
    EXPECT_EQ(events.back().kind, EventKind::kNothingDrawn);
    EXPECT_EQ(events.back().step, 200U);
    const auto warned = std::find_if(events.begin(), events.end(), [](const Event& event) {
        return event.kind == EventKind::kStep && event.warning;
    });
    ASSERT_NE(warned, events.end());
    EXPECT_EQ(warned->step, 20U);
    EXPECT_HAS(warned->text, "drew nothing");
    EXPECT_HAS(file("run", "run.json"), "\"nothing drawn\"");
}

/// White images and Gaussians that are not drawn before white.
TEST_F(TrainingTest, EqualImagesHaveAnInfinitePsnr) {
    const io::Image white{16, 16, 3, 8, std::vector<std::uint16_t>(3 * 16 * 16, 255)};
    for (const auto& entry : fs::recursive_directory_iterator(cars_.path))
        if (entry.path().parent_path().filename() == "rgb") test::put_png(entry.path(), white);
    const auto training =
        open(desc("run", {"model.opacity_bias=-30", "opt.iterations=1", "logging.val_log=0"}));
    const std::vector<Event> events = run(*training);
    const Event* const step = first_of(events, EventKind::kStep);
    ASSERT_NE(step, nullptr);
    EXPECT_EQ(number_of(*step, "psnr"), INFINITY);
    EXPECT_HAS(file("run", "metrics.jsonl"), "\"psnr\":null");
}

TEST_F(TrainingTest, EndsWhereNothingIsFinite) {
    const auto training = open(desc("run", {"opt.base_lr=1000", "opt.iterations=1000",
                                            "logging.val_log=0", "logging.ckpt_iterations=0"}));
    const std::vector<Event> events = run(*training);
    EXPECT_EQ(events.back().kind, EventKind::kNotFinite);
    EXPECT_GE(events.back().skipped, 10U);
}

TEST_F(TrainingTest, RefusesBeforeItMakesAFolder) {
    const auto refused = [&](const Asked& given, Code code, const char* sentence) {
        EXPECT_ERROR(refusal(given), code, sentence);
        EXPECT_FALSE(fs::exists(given.folder)) << sentence;
    };
    refused(desc("run", {"data.root=''"}), Code::kInvalidArgument, "'data.root' is empty");
    refused(desc("run", {"model.base_dim=9"}), Code::kInvalidArgument, "base_dim");
    refused(desc("run", {"opt."
                         "base_rl=1"}),
            Code::kInvalidArgument, "opt.base_lr");
    refused(desc("run", {"data.input_images=3"}), Code::kFormat, "3 views, expected at least 4");
    Asked given = desc("run");
    given.training.init = cars_.path + "/nothing.safetensors";
    EXPECT_FALSE(refusal(given).ok());
    given.training.init = "";
    const fs::path images = fs::path(cars_.path) / "srn_cars/cars_train";
    for (const auto& entry : fs::recursive_directory_iterator(images))
        if (entry.path().extension() == ".png") test::put_text(entry.path(), "damaged");
    EXPECT_FALSE(refusal(given).ok());
    EXPECT_FALSE(fs::exists(given.folder));
}

TEST_F(TrainingTest, DoesNotValidateOnWhatItTrainsOn) {
    const std::string objects = cars_.path + "/srn_cars/cars_train";
    const auto training = open(desc("run", {"data.root='" + objects + "'", "opt.iterations=1"}));
    EXPECT_EQ(first_of(run(*training), EventKind::kValidation), nullptr);
    EXPECT_HAS(file("run", "log.txt"), "no validation: '" + objects + "' has no splits");
}

/// Only a split that is missing means none.
TEST_F(TrainingTest, RefusesADamagedValidation) {
    const fs::path val = fs::path(cars_.path) / "srn_cars/cars_val";
    fs::remove_all(val / "000000_car/depth");
    EXPECT_ERROR(refusal(desc("run", {"data.use_pred_depth=true"})), Code::kNotFound,
                 "split val: maps requested: depth");
    fs::remove_all(val);
    EXPECT_TRUE(open(desc("run", {"data.use_pred_depth=true"})));
    EXPECT_HAS(file("run", "log.txt"), "no validation: ");
}

TEST_F(TrainingTest, StartsFromWeights) {
    run(*open(desc("first")));
    const std::string weights = (folder_.path() / "first/weights_last.safetensors").string();
    Asked given = desc("second", {"opt.iterations=0"});
    given.training.init = weights;
    const auto events = run(*open(given));
    EXPECT_EQ(events[0].text.substr(0, 12), "started from");
    EXPECT_TRUE(file("second", "weights_last.safetensors") ==
                file("first", "weights_last.safetensors"));
    run(*open(desc("third", {"opt.iterations=0", "opt.pretrained_ckpt='" +
                                                     (folder_.path() / "first").string() + "'"})));
    EXPECT_TRUE(file("third", "weights_last.safetensors") ==
                file("first", "weights_last.safetensors"));
    EXPECT_ERROR(refusal(desc("fourth", {"opt.pretrained_ckpt='" + cars_.path + "'"})),
                 Code::kNotFound, "holds neither model_latest.pth nor");
    given = desc("fifth", {"opt.iterations=0", "opt.pretrained_ckpt=none.pth"});
    given.training.init = weights;
    const auto both = run(*open(given));
    EXPECT_TRUE(both[0].warning);
    EXPECT_EQ(both[0].text, "warning: opt.pretrained_ckpt 'none.pth' is not read, because '" +
                                weights + "' is given to start from");
}

/// With a file that is lost while it trains.
TEST_F(TrainingTest, RecordsWhyItFailed) {
    const auto training = open(desc("run", {"opt.iterations=40"}));
    fs::rename(cars_.path, cars_.path + "_away");
    Event event;
    Status status;
    while (status.ok() && event.kind < EventKind::kDone) status = training->next(event);
    if (status.ok()) GTEST_FAIL() << "everything was read before";
    EXPECT_HAS(file("run", "run.json"), "\"state\": \"failed\"");
    EXPECT_HAS(file("run", "run.json"), "\"error\": \"cannot");
    EXPECT_HAS(file("run", "log.txt"), "error: cannot");
    fs::rename(cars_.path + "_away", cars_.path);
    EXPECT_EQ(run(*training).back().kind, EventKind::kDone);
    EXPECT_HAS(file("run", "run.json"), "\"state\": \"done\"");
    EXPECT_LACKS(file("run", "run.json"), "error");
}

/// Refuses an object whose turn comes late, before anything is written.
TEST_F(TrainingTest, ReadsAllCamerasFirst) {
    for (const auto& entry : fs::recursive_directory_iterator(cars_.path))
        if (entry.path().filename() == "000001.txt" &&
            entry.path().string().find("_val/") != std::string::npos)
            test::put_text(entry.path(), "1 0 0 nan  0 1 0 0  0 0 1 0  0 0 0 1");
    const Asked given = desc("run");
    EXPECT_ERROR(refusal(given), Code::kFormat, "000001.txt");
    EXPECT_FALSE(fs::exists(given.folder));
}

/// Weights of the same channels are copied, those of RGB alone are widened.
TEST_F(TrainingTest, StartsFromPretrainedWeightsOfItsChannels) {
    run(*open(desc("rgb", {"opt.iterations=0"})));
    const auto from = [&](const char* run) {
        return "opt.pretrained_ckpt='" + (folder_.path() / run).string() + "'";
    };
    const auto first_event = [&](const char* run_name, const char* start) {
        return run(*open(
            desc(run_name, {"opt.iterations=0", "data.use_pred_depth=true", from(start)})))[0]
            .text;
    };
    EXPECT_HAS(first_event("depth", "rgb"), ", 1 widened,");
    EXPECT_HAS(first_event("again", "depth"), ", 0 widened,");
    EXPECT_ERROR(refusal(desc("none", {"opt.pretrained_ckpt=none.pth"})), Code::kNotFound,
                 "opt.pretrained_ckpt: cannot open 'none.pth'");
}

/// A data set that the caller has opened, and none for validation.
TEST_F(TrainingTest, TakesAnOpenDataSet) {
    data::DatasetDesc cars;
    cars.path = cars_.path;
    cars.resolution = 16;
    cars.background = {1, 1, 1};
    auto opened = need(data::Dataset::open(cars));
    Asked given = desc("open", {"data.root=''"});
    given.training.dataset = std::move(opened);
    const auto events = run(*open(given));
    EXPECT_EQ(kinds_of(events), ".csscsscd");
    run(*open(desc("root")));
    EXPECT_TRUE(file("open", "weights_last.safetensors") ==
                file("root", "weights_last.safetensors"));
}

}  // namespace
}  // namespace splat::train
