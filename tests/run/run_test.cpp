#include <regex>

#include "run/toy.h"

namespace splat::run {
namespace {

TEST_F(RunTest, PlaysATask) {
    EXPECT_EQ(play("toy", Mode::kNew), "..coovsscoovsscoovd");
    const std::string metrics = file("toy/metrics.jsonl");
    EXPECT_EQ(metrics.find("{\"step\":0,\"val_psnr\":1,\"val_pieces\":2}\n{\"step\":1,\"loss\":1,"
                           "\"half\":0.5,\"skipped\":0,\"seconds\":"),
              0U)
        << metrics;
    EXPECT_HAS(metrics, "\"peak_bytes\":5,\"odd\":true}\n");
    const std::string record = file("toy/run.json");
    EXPECT_HAS(record,
               "\"ledger\": {\"odd\": false},\n  \"state\": \"done\",\n  \"library\": "
               "\"1.2.3\",\n  \"toy\": \"toy\"\n}\n");
    EXPECT_EQ(file("toy/log.txt"),
              "starts\nplays\nstep 0: validated\nstep 2: validated\nstep 4: validated\n"
              "done: 4 steps, loss 0.958196, best toy PSNR 16.00 dB\n");
}

TEST_F(RunTest, GivesNumbersByName) {
    const auto opened = need(open("toy"));
    const auto names = [&](EventKind kind) {
        Event event;
        while (event.kind != kind) EXPECT_OK(opened->next(event));
        std::string all;
        for (const Number& number : event.numbers) all += std::string(number.name) + " ";
        return all;
    };
    EXPECT_EQ(names(EventKind::kValidatedPiece), "val_psnr ");
    EXPECT_EQ(names(EventKind::kValidation), "val_psnr best_val_psnr val_pieces more ");
    EXPECT_EQ(names(EventKind::kStep), "loss averaged_loss half odd ");
}

TEST_F(RunTest, GoesOnBitByBitFromAnyPlace) {
    play("whole", Mode::kNew);
    for (std::size_t calls = 0; calls < 19; ++calls) {
        fs::remove_all(folder_ / "parts");
        {
            const auto begun = need(open("parts"));
            play(*begun, calls);
        }
        play("parts", Mode::kResume);
        for (const char* name : {"toy_last.safetensors", "toy_best.safetensors",
                                 "checkpoints/step_0000000004.state.safetensors"})
            EXPECT_TRUE(file(std::string("whole/") + name) == file(std::string("parts/") + name))
                << name << " after " << calls;
    }
}

TEST_F(RunTest, RefusesToGoOnWithOtherFacts) {
    play("toy", Mode::kNew);
    ToyDesc other;
    other.data = "another";
    EXPECT_ERROR(open("toy", Mode::kResume, other), Code::kInvalidArgument, "another toy");
    EXPECT_OK(open("begun"));
    test::put_text(folder_ / "begun/run.json", "{}");
    EXPECT_ERROR(open("begun", Mode::kResume), Code::kFormat,
                 "begun/run.json' tells of no toy; without it a run that has no state yet cannot "
                 "begin again");
}

/// Scores of another protocol are not compared.
TEST_F(RunTest, OtherValidationsBeginAnew) {
    play("toy", Mode::kNew);
    EXPECT_EQ(play("toy", Mode::kResume), "..d");
    ToyDesc other;
    other.pieces = 1;
    EXPECT_EQ(play("toy", Mode::kResume, other), "...ovd");
    EXPECT_HAS(file("toy/log.txt"),
               "warning: the validations so far saw other numbers of pieces, "
               "so the best toy PSNR and toy_best.safetensors begin anew");
}

TEST_F(RunTest, EndsWhereNothingIsLearned) {
    ToyDesc toy;
    toy.iterations = 1000;
    toy.pieces = 0;
    toy.validate_every = 0;
    toy.outcomes = {Outcome::kDrewNothing};
    EXPECT_EQ(play("asleep", Mode::kNew, toy).back(), 'b');
    const std::string asleep = file("asleep/log.txt");
    EXPECT_HAS(asleep,
               "step 20: 20 steps in a row drew nothing (it slept); the run fails after "
               "200");
    EXPECT_HAS(asleep, "nothing is learned: play more");
    toy.outcomes = {Outcome::kSkipped, Outcome::kSkipped, Outcome::kUpdated};
    toy.iterations = 5;
    toy.notice = "it rains";
    EXPECT_EQ(play("stumbles", Mode::kNew, toy).back(), 'd') << "never ten in a row";
    EXPECT_HAS(file("stumbles/log.txt"), "nothing was updated; it rains\n");
    EXPECT_HAS(file("stumbles/log.txt"), "warning: step 1: it rains\n");
    toy.notice = "";
    toy.outcomes = {Outcome::kSkipped};
    EXPECT_EQ(play("falls", Mode::kNew, toy), "..cssssssssssn");
    EXPECT_HAS(file("falls/log.txt"), "are not finite: play less; the last good state");
    ToyDesc diverges;
    diverges.not_finite_after = 4;
    const auto run = open("diverges", Mode::kNew, diverges);
    ASSERT_OK(run);
    EXPECT_EQ(play(*run.value()).back(), 'n');
    EXPECT_HAS(file("diverges/log.txt"), "what step 4 learned is not finite: play less");
    EXPECT_EQ(run.value()->figures().step, 2) << "that of the state it has again";
    EXPECT_HAS(file("diverges/run.json"), "\"step\": 2,");
    EXPECT_FALSE(fs::exists(folder_ / "diverges/checkpoints/step_0000000004.state.safetensors"));
    // It ends where its latest state is damaged, too.
    const auto damaged = need(open("damaged", Mode::kNew, diverges));
    const fs::path state = folder_ / "damaged/checkpoints/step_0000000002.state.safetensors";
    while (!fs::exists(state)) play(*damaged, 1);
    test::put_text(state, "no state");
    EXPECT_EQ(play(*damaged).back(), 'n');
    EXPECT_HAS(file("damaged/log.txt"), "skipped a state: ");
    EXPECT_EQ(damaged->figures().step, 0);
}

TEST_F(RunTest, IsInterrupted) {
    const auto opened = need(open("toy"));
    play(*opened, 7);
    interrupt_.raise();
    EXPECT_EQ(play(*opened), "ci");
    EXPECT_HAS(file("toy/run.json"), "\"interrupted\"");
    EXPECT_HAS(file("toy/log.txt"), "interrupted after step 1; play on\n");
}

/// A file without what differs between two runs that do the same.
std::string without_times(const std::string& text) {
    return std::regex_replace(text, std::regex("\"(seconds|folder)\": ?[^,]*,"), "");
}

constexpr Outcome kUpdated = Outcome::kUpdated, kSkipped = Outcome::kSkipped,
                  kNothing = Outcome::kDrewNothing;

/// How many steps a call of the task does changes nothing but their times.
TEST_F(RunTest, TellsStepsOneByOneThatWereDoneTogether) {
    ToyDesc toy;
    toy.iterations = 11;
    toy.validate_every = 5;
    toy.save_every = 3;
    const std::vector<Outcome> patterns[] = {
        {kUpdated},
        {kSkipped, kUpdated},
        {kUpdated, kSkipped, kSkipped, kUpdated, kNothing},
        {kUpdated, kUpdated, kUpdated, kUpdated, kSkipped, kSkipped, kSkipped, kSkipped, kSkipped,
         kSkipped, kSkipped, kSkipped, kSkipped, kSkipped, kUpdated}};
    for (const auto& pattern : patterns) {
        toy.outcomes = pattern;
        toy.together = 1;
        fs::remove_all(folder_ / "single");
        const std::string events = play("single", Mode::kNew, toy);
        for (const std::uint64_t together : {2, 5, 100}) {
            toy.together = together;
            fs::remove_all(folder_ / "many");
            EXPECT_EQ(play("many", Mode::kNew, toy), events) << together;
            for (const char* name : {"metrics.jsonl", "log.txt", "run.json"})
                EXPECT_EQ(without_times(file(std::string("many/") + name)),
                          without_times(file(std::string("single/") + name)))
                    << name << ", " << together;
            for (const auto& entry : fs::directory_iterator(folder_ / "single/checkpoints"))
                EXPECT_TRUE(test::file_text(entry.path()) ==
                            file("many/checkpoints/" + entry.path().filename().string()))
                    << entry.path() << ", " << together;
        }
    }
}

TEST_F(RunTest, EndsWhereNothingIsLearnedAmongStepsDoneTogether) {
    ToyDesc toy;
    toy.iterations = 1000;
    toy.pieces = 0;
    toy.validate_every = 0;
    toy.together = 7;
    toy.outcomes = {kUpdated, kUpdated};
    toy.outcomes.resize(100, kSkipped);
    const auto falls = need(open("falls", Mode::kNew, toy));
    EXPECT_EQ(play(*falls), "..cssssssssssssn");
    EXPECT_EQ(falls->figures().skipped, 10U) << "the steps after the tenth do not count";
    EXPECT_EQ(falls->figures().step, 0U) << "that of the state it has again";
    toy.outcomes = {kNothing};
    auto task = std::make_unique<Toy>(toy);
    const Toy& asleep = *task;
    const auto sleeps = need(run::Run::open({(folder_ / "sleeps").string(), Mode::kNew, "1.2.3"},
                                            std::move(task), interrupt_));
    EXPECT_EQ(play(*sleeps), "..c" + std::string(200, 's') + "b");
    EXPECT_EQ(asleep.progress().steps, 200U) << "and none beyond";
}

/// Steps that are done are told before a run ends, with the bits of one that goes on.
TEST_F(RunTest, IsInterruptedAmongStepsDoneTogether) {
    ToyDesc toy;
    toy.iterations = 8;
    toy.validate_every = 4;
    toy.outcomes = {kUpdated, kSkipped};
    play("whole", Mode::kNew, toy);
    toy.together = 3;
    for (const std::size_t calls : {6, 7, 8, 9, 12, 17, 22}) {
        fs::remove_all(folder_ / "parts");
        {
            const auto begun = need(open("parts", Mode::kNew, toy));
            play(*begun, calls);
            interrupt_.raise();
            play(*begun);
        }
        play("parts", Mode::kResume, toy);
        for (const char* name : {"toy_last.safetensors", "toy_best.safetensors",
                                 "checkpoints/step_0000000008.state.safetensors"})
            EXPECT_TRUE(file(std::string("whole/") + name) == file(std::string("parts/") + name))
                << name << " after " << calls;
        EXPECT_EQ(without_times(file("whole/metrics.jsonl")),
                  without_times(file("parts/metrics.jsonl")))
            << calls;
    }
}

TEST_F(RunTest, TellsTheStepsBeforeAnError) {
    ToyDesc toy;
    toy.pieces = 0;
    toy.validate_every = 0;
    toy.together = 4;
    for (const Code code : {Code::kIo, Code::kCancelled}) {
        toy.failure = code;
        toy.fails_at = 2;
        fs::remove_all(folder_ / "toy");
        const auto opened = need(open("toy", Mode::kNew, toy));
        EXPECT_EQ(play(*opened, 3), "..c");
        Event event;
        if (code == Code::kCancelled) {
            EXPECT_ERROR(opened->next(event), code, "it rests");
        }
        EXPECT_EQ(play(*opened), "sssscd");
        EXPECT_LACKS(file("toy/log.txt"), "it rests") << "the step was done by the next call";
        toy.fails_at = 0;
        const auto first = need(open("first", Mode::kReplace, toy));
        EXPECT_EQ(play(*first, 3), "..c");
        EXPECT_ERROR(first->next(event), code, "it rests");
        EXPECT_EQ(play(*first), "sssscd");
    }
}

}  // namespace
}  // namespace splat::run
