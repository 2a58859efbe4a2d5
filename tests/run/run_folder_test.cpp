#include "run/run_folder.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <iterator>
#include <thread>

#include "core/fault.h"
#include "support/expect_status.h"
#include "support/system.h"
#include "synthetic/sample_folder.h"

namespace splat::run {
namespace {

namespace fs = std::filesystem;
using Mode = RunFolder::Mode;
using test::put_text;

class RunFolderTest : public testing::Test {
  protected:
    std::unique_ptr<RunFolder> open(Mode mode) { return need(RunFolder::open(path(), mode)); }
    [[nodiscard]] std::string path() const { return (folder_ / "run").string(); }
    Status refusal(Mode mode) { return RunFolder::open(path(), mode).status(); }
    /// A run that has ended.
    void make_run() {
        const auto folder = open(Mode::kNew);
        ASSERT_OK(folder->begin("{}", {}));
    }

    test::SampleFolder folder_;
};

TEST_F(RunFolderTest, HoldsOneSessionAtATime) {
    const auto first = open(Mode::kNew);
    EXPECT_FALSE(fs::exists(path())) << "nothing is made before everything is known to be right";
    const auto second = open(Mode::kNew);
    ASSERT_OK(first->begin("{}", {}));
    const std::string process = "a run of process " + test::process_text();
    EXPECT_ERROR(second->begin("{}", {}), Code::kInvalidState, process);
    for (const Mode mode : {Mode::kResume, Mode::kReplace})
        EXPECT_ERROR(refusal(mode), Code::kInvalidState, process);
}

/// A lock file without its lock does not matter.
TEST_F(RunFolderTest, LockEndsWithItsProcess) {
    SPLAT_NEED_FORK();
    ASSERT_EQ(test::in_child([&] {
                  static auto folder = RunFolder::open(path(), Mode::kNew);  // until the end
                  return folder.ok() && folder.value()->begin("{}", {}).ok() ? 0 : 1;
              }),
              0);
    EXPECT_TRUE(fs::exists(path() + "/lock"));
    EXPECT_NE(open(Mode::kResume), nullptr);
}

/// A forked child that lives on does not keep the lock, and does not give it up.
TEST_F(RunFolderTest, LockIsTheProcessesNotItsChildrens) {
    SPLAT_NEED_FORK();
    auto folder = open(Mode::kNew);
    ASSERT_OK(folder->begin("{}", {}));
    const std::string end = (folder_ / "end").string();
    const test::Child child([&] {
        folder.reset();
        test::end_after(60);
        while (!fs::exists(end)) std::this_thread::sleep_for(std::chrono::milliseconds(1));
        return 0;
    });
    EXPECT_EQ(test::in_child([&] { return folder.reset(), 0; }), 0);
    EXPECT_ERROR(refusal(Mode::kResume), Code::kInvalidState, "a run of process");
    folder.reset();
    EXPECT_NE(open(Mode::kResume), nullptr);
    put_text(end, "");
    EXPECT_EQ(child.wait(), 0);
}

/// For example weights with their configuration beside them.
TEST_F(RunFolderTest, AConfigurationAloneIsNoRun) {
    put_text(path() + "/config.json", "{}");
    put_text(path() + "/mine.safetensors", "mine");
    for (const Mode mode : {Mode::kNew, Mode::kReplace})
        EXPECT_ERROR(refusal(mode), Code::kInvalidState, "is not a run");
    EXPECT_ERROR(refusal(Mode::kResume), Code::kInvalidState, "holds no run to resume");
    EXPECT_TRUE(fs::exists(path() + "/mine.safetensors"));
}

TEST_F(RunFolderTest, RefusesWhatItDoesNotExpect) {
    EXPECT_ERROR(refusal(Mode::kResume), Code::kInvalidState, "holds no run to resume");
    put_text(path() + "/mine.txt", "mine");
    for (const Mode mode : {Mode::kNew, Mode::kReplace})
        EXPECT_ERROR(refusal(mode), Code::kInvalidState, "is not a run");
    fs::remove_all(path());
    make_run();
    EXPECT_ERROR(refusal(Mode::kNew), Code::kInvalidState, "holds a run");
    put_text(folder_ / "file", "");
    EXPECT_ERROR(RunFolder::open((folder_ / "file").string(), Mode::kNew), Code::kInvalidState,
                 "is not a run");
}

TEST_F(RunFolderTest, BeginsBesideInputThatWasPrepared) {
    put_text(path() + "/data/0001.png", "mine");
    EXPECT_ERROR(refusal(Mode::kNew), Code::kInvalidState, "is not a run");
    put_text(path() + "/prepared.json", "{}");
    make_run();
    EXPECT_TRUE(fs::exists(path() + "/data/0001.png"));
    EXPECT_TRUE(fs::exists(path() + "/prepared.json"));
    EXPECT_ERROR(refusal(Mode::kNew), Code::kInvalidState, "holds a run");
}

TEST_F(RunFolderTest, ReplacesARunButKeepsItUntilThen) {
    make_run();
    put_text(path() + "/checkpoints/step_0000000001.state.safetensors", "old");
    put_text(path() + "/renders/step_00000001.png", "old");
    put_text(path() + "/weights_best.safetensors", "old");
    put_text(path() + "/scene_best.safetensors", "mine");
    for (const char* name : {"objects.json", "per_image.csv", "per_object.csv", "per_view.csv", "report.html",
                             "results.json", "scores.txt"})
        put_text(path() + "/eval/" + name, "old");
    for (const char* name : {"notes.txt", "half.tmp", "eval/mine.txt"})
        put_text(path() + "/" + name, "mine");
    const auto folder = open(Mode::kReplace);
    EXPECT_TRUE(fs::exists(path() + "/renders/step_00000001.png"));
    ASSERT_OK(folder->begin("{\"a\": 1}", {"weights"}));
    EXPECT_FALSE(fs::exists(path() + "/renders"));
    EXPECT_FALSE(fs::exists(path() + "/weights_best.safetensors"));
    EXPECT_TRUE(fs::exists(path() + "/scene_best.safetensors")) << "no result of the task";
    EXPECT_EQ(std::distance(fs::directory_iterator(path() + "/eval"), {}), 1) << "what is mine";
    for (const char* name : {"notes.txt", "half.tmp", "eval/mine.txt"})
        EXPECT_EQ(test::file_text(path() + "/" + name), "mine");
    EXPECT_TRUE(folder->states().value().empty());
    EXPECT_EQ(test::file_text(path() + "/config.json"), "{\"a\": 1}");
}

TEST_F(RunFolderTest, SweepsWhatACrashLeft) {
    make_run();
    put_text(path() + "/run.json.12-1.tmp", "half");
    put_text(path() + "/checkpoints/step_0000000002.state.safetensors.12-2.tmp", "half");
    put_text(path() + "/checkpoints/step_0000000001.state.safetensors", "whole");
    const auto folder = open(Mode::kResume);
    EXPECT_EQ(need(folder->begin("{}", {})), 2U);
    EXPECT_EQ(folder->states().value().size(), 1U);
    EXPECT_FALSE(fs::exists(path() + "/run.json.12-1.tmp"));
}

/// A process that was killed while it made the folder.
TEST_F(RunFolderTest, BeginsInAFolderThatWasOnlyBegun) {
    put_text(path() + "/lock", "12\n");
    put_text(path() + "/config.json.12-1.tmp", "{");
    const auto folder = open(Mode::kNew);
    EXPECT_OK(folder->begin("{}", {}));
}

TEST_F(RunFolderTest, CutsMetricsOfStepsThatRunAgain) {
    make_run();
    put_text(path() + "/metrics.jsonl",
             "{\"step\":2,\"val_psnr\":12.25}\n{\"step\":3,\"val_psnr\":null}\n{\"step\":1e300}\n"
             "{\"step\":4}\n{\"st");
    const auto folder = open(Mode::kResume);
    ASSERT_OK(folder->begin("{}", {}));
    ASSERT_EQ(folder->metrics().value().size(), 3U);
    const auto psnr = [&](std::size_t line) {
        return folder->metrics().value()[line].number("val_psnr");
    };
    EXPECT_EQ(psnr(0), 12.25);
    ASSERT_TRUE(psnr(1)) << "a validation without a score was done";
    EXPECT_TRUE(std::isnan(*psnr(1)));
    EXPECT_EQ(psnr(2), std::nullopt);
    ASSERT_OK(folder->cut_metrics(3));
    ASSERT_OK(folder->metric("{\"step\":4}"));
    EXPECT_EQ(test::file_text(path() + "/metrics.jsonl"),
              "{\"step\":2,\"val_psnr\":12.25}\n{\"step\":3,\"val_psnr\":null}\n{\"step\":4}\n");
}

#if SPLAT_FAULT_POINTS
TEST_F(RunFolderTest, ALockThatCannotBeWrittenIsAnError) {
    const auto folder = open(Mode::kNew);
    fault::arm("io.write", 1);
    EXPECT_ERROR(folder->begin("{}", {}), Code::kIo, "/lock': No space left");
    EXPECT_EQ(fault::disarm(), 1U);
}

/// A folder that cannot be listed is not an empty one: a resumed run would begin again and cut its metrics.
TEST_F(RunFolderTest, WhatCannotBeListedIsAnError) {
    {
        const auto folder = open(Mode::kNew);
        ASSERT_OK(folder->begin("{}", {}));
        put_text(folder->state_path(3), "state");
        fault::arm("io.list", 1);
        EXPECT_ERROR(folder->states(), Code::kIo, "cannot list the folder '");
        folder->keep_latest_states(0);
        EXPECT_EQ(fault::disarm(), 2U);
        EXPECT_EQ(folder->states().value().size(), 1U) << "nothing was removed";
    }
    const auto resumed = open(Mode::kResume);
    if (test::makes_links_in(path())) fs::create_symlink("x", path() + "/link");
    fault::arm("io.stat", 1, fault::kForever);
    EXPECT_OK(resumed->begin("{}", {})) << "what a link names does not matter";
    fault::disarm();
    fault::arm("io.list", 1);
    EXPECT_ERROR(resumed->begin("{}", {}), Code::kIo, "cannot list the folder '");
    EXPECT_EQ(fault::disarm(), 1U);
}

TEST_F(RunFolderTest, GoesOnWithItsLinesAfterAFullDisk) {
    const auto folder = open(Mode::kNew);
    ASSERT_OK(folder->begin("{}", {}));
    fault::arm("io.write", 1, 2);
    EXPECT_ERROR(folder->metric("{\"step\":1}"), Code::kIo, "metrics.jsonl': No space left");
    EXPECT_ERROR(folder->log("one"), Code::kIo, "log.txt': No space left");
    EXPECT_EQ(fault::disarm(), 2U);
    ASSERT_OK(folder->metric("{\"step\":2}"));
    ASSERT_OK(folder->log("two"));
    EXPECT_EQ(test::file_text(path() + "/metrics.jsonl"), "{\"step\":2}\n");
    EXPECT_EQ(test::file_text(path() + "/log.txt"), "two\n");
}
#endif

TEST_F(RunFolderTest, KeepsTheLatestStates) {
    const auto folder = open(Mode::kNew);
    ASSERT_OK(folder->begin("{}", {}));
    for (const std::uint64_t step : {1U, 10U, 9U}) put_text(folder->state_path(step), "state");
    folder->keep_latest_states(2);
    const auto left = folder->states().value();
    ASSERT_EQ(left.size(), 2U);
    EXPECT_EQ(left[0].generic_string(), folder->state_path(10));
    EXPECT_EQ(left[1].generic_string(), folder->state_path(9));
}

TEST_F(RunFolderTest, SetsAsideAStateThatCannotBeRead) {
    const auto folder = open(Mode::kNew);
    ASSERT_OK(folder->begin("{}", {}));
    for (const std::uint64_t step : {1U, 2U}) put_text(folder->state_path(step), "state");
    ASSERT_OK(folder->set_aside(folder->state_path(2)));
    EXPECT_EQ(test::file_text(folder->state_path(2) + ".unreadable"), "state");
    ASSERT_EQ(folder->states().value().size(), 1U);
    EXPECT_ERROR(folder->set_aside(folder->state_path(2)), Code::kIo, "cannot rename");
}

/// For example beside a process that clears the folder.
TEST_F(RunFolderTest, NoFolderHoldsNoStates) {
    make_run();
    const auto folder = open(Mode::kResume);
    fs::remove_all(path() + "/checkpoints");
    const auto is_empty = [&] {
        const auto states = folder->states();
        EXPECT_OK(states);
        return states.ok() && states.value().empty();
    };
    EXPECT_TRUE(is_empty());
    SPLAT_NEED_LINKS(path());
    fs::create_symlink("nothing", path() + "/checkpoints");
    EXPECT_TRUE(is_empty());
    fs::remove(path() + "/checkpoints");
    put_text(path() + "/checkpoints", "a file");
    EXPECT_TRUE(is_empty());
}

TEST_F(RunFolderTest, SaysWhyItCannotWrite) {
    put_text(folder_ / "file", "");
    const auto folder = need(RunFolder::open((folder_ / "file/run").string(), Mode::kNew));
    EXPECT_ERROR(folder->begin("{}", {}), Code::kIo, "cannot make the folder");
}

}  // namespace
}  // namespace splat::run
