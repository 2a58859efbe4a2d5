// Trainings that go on: what stays the same, what may change, what is refused.
#include <algorithm>
#include <cmath>
#include <regex>

#include "train/training_fixture.h"

namespace splat::train {
namespace {

class TrainingResume : public TrainingTest {};

TEST_F(TrainingResume, GoesOnBitByBitFromAnyPlace) {
    run(*open(desc("whole")));
    // Left alone after so many calls, as by a process that is killed there.
    for (const int calls : {2, 5, 6, 8, 11, 14}) {
        fs::remove_all(folder_.path() / "parts");
        {
            const auto training = open(desc("parts"));
            Event event;
            for (int i = 0; i < calls; ++i) ASSERT_OK(training->next(event));
        }
        const auto training = open(resumed("parts"));
        ASSERT_TRUE(training) << calls;
        run(*training);
        expect_equal_weights("whole", "parts");
    }
}

/// Batches, losses, rate and targets change after the second update.
std::vector<std::string> two_stages() {
    return {
        "opt.micro_batch=1",
        "opt.stages=[{iterations: 2, batch_size: 2, loss: l1, target_resolution: 8}, {iterations: "
        "2, batch_size: 1, base_lr: 2e-3, lambda_edge: 0.1, lambda_plane: 5}]",
        "opt.num_workers=2", "logging.ckpt_iterations=1"};
}

TEST_F(TrainingResume, GoesOnBitByBitInBothStages) {
    test::put_planes(cars_.path);
    const auto whole = run(*open(desc("whole", two_stages())));
    std::vector<double> stages, rates;
    for (const Event& event : whole)
        if (event.kind == EventKind::kStep) {
            stages.push_back(number_of(event, "stage"));
            rates.push_back(number_of(event, "rate"));
        }
    EXPECT_EQ(stages, (std::vector<double>{0, 0, 1, 1}));
    EXPECT_EQ(rates, (std::vector<double>{1e-3, 1e-3, 2e-3, 2e-3}));
    EXPECT_HAS(file("whole", "metrics.jsonl"), "\"plane\":");
    {
        const auto first = open(desc("parts", two_stages()));
        Event event;
        while (event.step < 1) ASSERT_OK(first->next(event));
        interrupt_.raise();
        EXPECT_EQ(run(*first).back().kind, EventKind::kInterrupted);
    }
    for (const std::uint64_t until :
         {2, 3}) {  // the end of the first stage, the middle of the second
        const auto next = open(resumed("parts"));
        Event event;
        while (event.step < until) ASSERT_OK(next->next(event));
        interrupt_.raise();
        EXPECT_EQ(run(*next).back().kind, EventKind::kInterrupted);
    }
    run(*open(resumed("parts")));
    expect_equal_weights("whole", "parts");
    for (const char* name : {"checkpoints/step_0000000003.state.safetensors",
                             "checkpoints/step_0000000004.state.safetensors"}) {
        ASSERT_TRUE(fs::exists(folder_ / "whole" / name)) << name;
        EXPECT_TRUE(file("whole", name) == file("parts", name)) << name;
    }
    EXPECT_ERROR(refusal(resumed("parts", {"opt.stages.1.iterations=3"})), Code::kInvalidArgument,
                 "'opt.stages' is [{iterations: 2, batch_size: 2");
}

/// What a later stage lacks is found before the first step.
TEST_F(TrainingResume, LooksAtAllStagesFirst) {
    EXPECT_ERROR(refusal(desc("run", {"opt.stages=[{iterations: 1}, {iterations: 1, lambda_lpips: "
                                      "0.1}, {iterations: 2}]"})),
                 Code::kInvalidArgument, "stage 1 of 'opt.stages': 'opt.lambda_lpips' is 0.1, but");
    EXPECT_ERROR(refusal(desc("run", {"opt.stages=[{iterations: 1}, {iterations: 3, lambda_lpips: "
                                      "0.1}]"})),
                 Code::kInvalidArgument, "stage 1 of 'opt.stages': 'opt.lambda_lpips' is 0.1, but");
    EXPECT_FALSE(fs::exists(folder_ / "run"));
}

TEST_F(TrainingResume, TakesOnResumingWhatMayChange) {
    run(*open(desc("run")));
    const std::string before = file("run", "config.json");
    EXPECT_ERROR(refusal(resumed("run", {"opt.base_lr=1e-4"})), Code::kInvalidArgument,
                 "'opt.base_lr' is 0.0001, but 0.001 in the run that is resumed");
    EXPECT_ERROR(refusal(resumed("run", {"model.base_dim=16"})), Code::kInvalidArgument,
                 "'model.base_dim' is 16, but 8 in the run");
    Asked given = resumed("run");
    given.training.config = "opt: {iterations: 5}";
    EXPECT_ERROR(refusal(given), Code::kInvalidArgument, "in the run that is resumed")
        << "a configuration that is given stands for all of its values";
    given = resumed("run");
    given.training.init = "weights.safetensors";
    EXPECT_ERROR(refusal(given), Code::kInvalidArgument, "starts from its own state");
    EXPECT_EQ(file("run", "config.json"), before);

    const auto training = open(resumed("run", {"opt.iterations=5", "logging.val_log=0"}));
    const std::vector<Event> events = run(*training);
    EXPECT_EQ(events[0].text, "opt.iterations 4 -> 5");
    EXPECT_EQ(events[1].text, "logging.val_log 2 -> 0");
    EXPECT_EQ(events.back().step, 5U);
    EXPECT_HAS(file("run", "config.json"), "\"iterations\": 5");
}

/// Steps that are read together give what steps read one by one give, except times.
TEST_F(TrainingResume, ReadsResultsTogether) {
    const auto log = [&](const std::string& run, const char* name) {
        return std::regex_replace(
            file(run, name), std::regex("\"(seconds|[a-z]+_ms|folder)\": ?[^,]*,|training \\S+"),
            "");
    };
    const auto weights = [&](const std::string& run, const std::string& name) {
        return need(io::load_weights((folder_.path() / run / name).string())).tensors;
    };
    const std::vector<std::string> changes = {"opt.iterations=9", "logging.val_log=7",
                                              "logging.ckpt_iterations=4"};
    run(*open(desc("single", changes)));
    std::vector<std::string> together = changes;
    together.insert(together.end(), {"opt.read_every=5", "opt.num_workers=3"});
    run(*open(desc("many", together)));
    const auto expect_same = [&](const std::string& other) {
        EXPECT_EQ(log("single", "metrics.jsonl"), log(other, "metrics.jsonl"));
        for (const char* name : {"weights_last.safetensors", "weights_best.safetensors"})
            EXPECT_TRUE(file("single", name) == file(other, name)) << name;
        const char* const state = "checkpoints/step_0000000009.state.safetensors";
        EXPECT_EQ(io::crc32_of(weights("single", state)), io::crc32_of(weights(other, state)));
    };
    expect_same("many");
    for (const char* name : {"log.txt", "run.json"})
        EXPECT_EQ(log("single", name), log("many", name)) << name;
    {
        const auto begun = open(desc("parts", together));
        Event event;
        while (event.step < 2) ASSERT_OK(begun->next(event));
        interrupt_.raise();
        EXPECT_EQ(kinds_of(run(*begun)), "ssci") << "the steps up to the next state";
    }
    run(*open(resumed("parts", {"opt.read_every=2"})));
    EXPECT_HAS(file("parts", "log.txt"), "opt.read_every 5 -> 2");
    expect_same("parts");
    const auto events = run(*open(desc("scales", {"opt.read_every=2", "opt.scale_terms=true"})));
    EXPECT_TRUE(events[0].warning);
    EXPECT_HAS(events[0].text, "'opt.read_every' has no effect while opt.scale_terms is true");
    SplatterTraining task(context_,
                          desc("each", {"opt.read_every=2", "opt.scale_terms=true"}).training);
    run::Messages messages;
    ASSERT_OK(task.prepare(nullptr, messages));
    ASSERT_OK(task.start(messages));
    ASSERT_OK(task.begin());
    std::deque<run::Step> done;
    ASSERT_OK(task.step(2, done));
    EXPECT_EQ(done.size(), 1U);
}

TEST_F(TrainingResume, WarnsOfACosineThatGoesOn) {
    run(*open(desc("run", {"opt.lr_schedule=cosine"})));
    const std::vector<Event> events = run(*open(resumed("run", {"opt.iterations=5"})));
    EXPECT_TRUE(events[0].warning);
    EXPECT_HAS(events[0].text, "opt.iterations 4 -> 5: with opt.lr_schedule cosine");
    EXPECT_EQ(events.back().step, 5U);
}

/// The same data in another folder goes on, other data does not.
TEST_F(TrainingResume, ResumesWithTheDataOfTheRun) {
    run(*open(desc("run")));
    fs::copy(cars_.path, cars_.path + "_moved", fs::copy_options::recursive);
    const std::string moved = "data.root='" + cars_.path + "_moved'";
    EXPECT_EQ(run(*open(resumed("run", {moved, "opt.iterations=5"}))).back().step, 5U);
    const fs::path train = fs::path(cars_.path + "_moved") / "srn_cars/cars_train";
    fs::copy(fs::directory_iterator(train)->path(), train / "zzz", fs::copy_options::recursive);
    const std::string before = file("run", "run.json");
    EXPECT_ERROR(refusal(resumed("run", {moved, "opt.iterations=6"})), Code::kInvalidArgument,
                 "'objects' is 3, but 2 in run.json");
    EXPECT_EQ(file("run", "run.json"), before);
    // The same number of other objects.
    const fs::path gone = *fs::directory_iterator(train);
    fs::remove_all(gone.filename() == "zzz" ? *std::next(fs::directory_iterator(train)) : gone);
    EXPECT_ERROR(refusal(resumed("run", {moved, "opt.iterations=6"})), Code::kInvalidArgument,
                 "its objects have other names or numbers of views, though there are as many");
    EXPECT_EQ(file("run", "run.json"), before);
    // A run of an earlier version does not say.
    std::string old = before;
    const std::size_t hash = old.find("\"hash\": ");
    ASSERT_NE(hash, std::string::npos);
    old.erase(hash, old.find(',', hash) + 2 - hash);
    test::put_text(folder_.path() / "run/run.json", old);
    const auto events = run(*open(resumed("run", {moved, "opt.iterations=6"})));
    EXPECT_TRUE(std::any_of(events.begin(), events.end(), [](const Event& event) {
        return event.warning && event.text.find("other data of the same size") != std::string::npos;
    }));
}

/// Host memory may run out between a piece and its event: then the run asks for the piece again.
TEST_F(TrainingResume, APieceThatIsDoneAgainCountsOnce) {
    SplatterTraining task(context_, desc("run").training);
    run::Messages messages;
    ASSERT_OK(task.prepare(nullptr, messages));
    ASSERT_OK(task.start(messages));
    ASSERT_OK(task.begin());
    ASSERT_OK(task.begin_validation(need(task.results())));
    for (int i = 0; i < 2; ++i) {
        run::Piece piece;
        ASSERT_OK(task.validate(0, piece));
    }
    Event event;
    event.numbers = task.validation().scores;
    EXPECT_EQ(number_of(event, "val_objects"), 1);
}

/// Scores of other views are not compared, nor is a validation of them taken for that of the step.
TEST_F(TrainingResume, OtherValidationsBeginAnew) {
    run(*open(desc("run")));
    auto same = open(resumed("run", {"opt.iterations=5"}));
    EXPECT_GT(same->figures().best_validation_psnr, 0);
    EXPECT_GT(same->figures().validation_psnr, 0) << "that of the latest validation";
    EXPECT_LACKS(file("run", "run.json"), "\"val_psnr\": 0,");
    const std::string kept = format("\"val_psnr\": %.17g", same->figures().validation_psnr);
    EXPECT_HAS(file("run", "run.json"), kept);
    EXPECT_EQ(kinds_of(run(*same)), "...scovd");
    same.reset();
    auto other = open(resumed("run", {"logging.val_views=1"}));
    EXPECT_EQ(other->figures().best_validation_psnr, 0);
    EXPECT_TRUE(std::isnan(other->figures().validation_psnr));
    const std::vector<Event> events = run(*other);
    EXPECT_EQ(kinds_of(events), "....ovd");
    const auto warned = std::find_if(events.begin(), events.end(),
                                     [](const Event& event) { return event.warning; });
    ASSERT_NE(warned, events.end());
    EXPECT_EQ(warned->text,
              "warning: the validations so far saw other numbers of objects or views, so the best "
              "validation PSNR and weights_best.safetensors begin anew");
    const double best = other->figures().best_validation_psnr;
    EXPECT_EQ(best, number_of(*first_of(events, EventKind::kValidation), "val_psnr"));
    other.reset();
    const auto again = open(resumed("run"));
    EXPECT_EQ(again->figures().best_validation_psnr, best);
    EXPECT_EQ(kinds_of(run(*again)), "..d");
}

/// A run that was killed after its record and before its first state.
TEST_F(TrainingResume, BeginsAgainWithoutAState) {
    run(*open(desc("whole")));
    open(desc("run"));
    const auto events = run(*open(resumed("run")));
    EXPECT_EQ(events[0].text, "the run has no state yet, and begins again");
    expect_equal_weights("whole", "run");

    Asked given = desc("started", {"opt.iterations=0"});
    given.training.init = (folder_.path() / "whole/weights_last.safetensors").string();
    open(given);
    run(*open(resumed("started")));
    EXPECT_TRUE(file("started", "weights_last.safetensors") ==
                file("whole", "weights_last.safetensors"));
    open(desc("lost"));
    fs::remove(folder_.path() / "lost/run.json");
    EXPECT_ERROR(refusal(resumed("lost")), Code::kNotFound,
                 "run.json': No such file or directory; without it a run that has no state");
}

/// They have higher numbers than the states that follow.
TEST_F(TrainingResume, SetsStatesAsideThatItCannotRead) {
    run(*open(desc("whole")));
    run(*open(desc("run")));
    const fs::path states = folder_.path() / "run/checkpoints";
    const std::string latest = (states / "step_0000000004.state.safetensors").string();
    test::put_text(latest, "damaged");
    test::put_text((states / "step_0000000003.state.safetensors").string(), "damaged");
    const auto events = run(*open(resumed("run")));
    EXPECT_TRUE(events[0].warning);
    EXPECT_EQ(events[0].text.substr(0, 15), "skipped a state");
    EXPECT_EQ(test::file_text(latest + ".unreadable"), "damaged");
    expect_equal_weights("whole", "run");
}

}  // namespace
}  // namespace splat::train
