// A toy that several ranks play: rank 0 with the folder, the others behind it.
#include <mutex>

#include "run/follower.h"
#include "run/thread_group.h"
#include "run/toy.h"

namespace splat::run {
namespace {

/// What a rank saw.
struct Seen {
    Status opened, ended;
    std::string letters, text;  ///< letters of its events, and the last text
};

/// What is special on a rank.
struct Special {
    ToyDesc toy;
    std::string library = "1.2.3";
    std::size_t most = 1000;                 ///< calls before it closes its run
    std::function<void(std::size_t)> after;  ///< call, with the calls so far
    Interrupt* interrupt = nullptr;
};
using Specials = std::function<void(std::uint32_t, Special&)>;

class RanksTest : public RunTest {
  protected:
    /// Play a toy by a number of ranks.
    std::vector<Seen> play(std::uint32_t count, const std::string& name, Mode mode,
                           const Specials& specials = {}) {
        ThreadGroup threads(count, 20);
        threads_ = &threads;
        std::vector<Seen> seen(count);
        threads.run([&](const GroupCalls& calls) {
            Group group(calls);
            Interrupt interrupt;
            Special special;
            special.interrupt = &interrupt;
            special.toy.group = &group;
            if (specials) specials(group.rank(), special);
            auto task = std::make_unique<Toy>(special.toy);
            std::unique_ptr<Work> work;
            Seen& mine = seen[group.rank()];
            if (group.leads()) {
                auto run =
                    run::Run::open({(folder_ / name).string(), mode, special.library, &group},
                                   std::move(task), interrupt);
                mine.opened = run.status();
                if (run.ok()) work = std::move(run.value());
            } else {
                auto follower = Follower::open(group, special.library, std::move(task), interrupt);
                mine.opened = follower.status();
                if (follower.ok()) work = std::move(follower.value());
            }
            if (work != nullptr) play(*work, special, mine);
        });
        return seen;
    }
    static void play(Work& work, const Special& special, Seen& seen) {
        Event event;
        while (event.kind < EventKind::kDone && seen.letters.size() < special.most) {
            seen.ended = work.next(event);
            if (!seen.ended.ok()) {
                const Status again = work.next(event);
                EXPECT_EQ(again.message(), seen.ended.message()) << "it stays so";
                return;
            }
            seen.letters += kLetters[static_cast<int>(event.kind)];
            if (!event.text.empty()) seen.text = event.text;
            if (special.after) special.after(seen.letters.size());
        }
    }
    /// The same error on every rank.
    static void expect_all(const std::vector<Seen>& seen, Status Seen::*which, Code code,
                           const std::string& says) {
        for (const Seen& one : seen) EXPECT_ERROR(one.*which, code, says);
    }
    void expect_equal(const std::string& a, const std::string& b) const {
        for (const char* name : {"toy_last.safetensors", "toy_best.safetensors",
                                 "checkpoints/step_0000000004.state.safetensors"})
            EXPECT_TRUE(file(a + "/" + name) == file(b + "/" + name)) << b << " " << name;
    }
    ThreadGroup* threads_ = nullptr;
};

TEST_F(RanksTest, PlayTogether) {
    const std::string alone = RunTest::play("alone", Mode::kNew);
    for (const std::uint32_t count : {1U, 2U, 4U}) {
        const std::string name = "by" + std::to_string(count);
        const auto seen = play(count, name, Mode::kNew);
        EXPECT_EQ(seen[0].letters, alone);
        for (std::uint32_t rank = 1; rank < count; ++rank) {
            EXPECT_EQ(seen[rank].letters, "ssssd");
            EXPECT_EQ(seen[rank].text, seen[0].text);
        }
        expect_equal("alone", name);
        EXPECT_EQ(file(name + "/log.txt"), file("alone/log.txt"));
    }
}

TEST_F(RanksTest, AnInterruptOfAnyRankEndsAllAndAnotherCountGoesOn) {
    RunTest::play("whole", Mode::kNew);
    const std::pair<std::uint32_t, std::uint32_t> cases[] = {{0, 1}, {1, 2}, {3, 8}};
    for (const auto& [asked, count] : cases) {
        fs::remove_all(folder_ / "parts");
        const auto seen =
            play(4, "parts", Mode::kNew, [&, asked = asked](std::uint32_t rank, Special& special) {
                if (rank == asked)
                    special.after = [&, rank](std::size_t calls) {
                        if (calls == (rank == 0 ? 7 : 1)) special.interrupt->raise();
                    };
            });
        for (const Seen& one : seen) {
            EXPECT_EQ(one.letters.back(), 'i');
            EXPECT_EQ(one.text.find("interrupted after step "), 0U) << one.text;
        }
        EXPECT_HAS(file("parts/run.json"), "\"interrupted\"");
        EXPECT_FALSE(fs::exists(folder_ / "parts/checkpoints/step_0000000004.state.safetensors"));
        EXPECT_EQ(play(count, "parts", Mode::kResume).back().letters.back(), 'd');
        expect_equal("whole", "parts");
    }
}

TEST_F(RanksTest, AnErrorOfAnyRankEndsAll) {
    for (const Code code : {Code::kDeviceLost, Code::kCancelled}) {
        const auto seen = play(4, "toy", Mode::kReplace, [&](std::uint32_t rank, Special& special) {
            if (rank == 2) special.toy.fails_at = 3;
            special.toy.failure = code;
            special.toy.together = 2;
        });
        expect_all(seen, &Seen::ended, code, "rank 2: it rests");
        EXPECT_EQ(seen[0].ended.message(), "rank 2: it rests");
        EXPECT_EQ(seen[0].letters, "..coovsscoovs") << "the step before it is told";
        EXPECT_EQ(seen[3].letters, "sss");
        EXPECT_HAS(file("toy/run.json"), "\"failed\"");
        EXPECT_HAS(file("toy/run.json"), "\"error\": \"rank 2: it rests\"");
        EXPECT_HAS(file("toy/log.txt"), "error: rank 2: it rests\n");
    }
    RunTest::play("whole", Mode::kNew);
    play(2, "toy", Mode::kResume);
    expect_equal("whole", "toy");
}

/// A file that cannot be written, like one on a full disk.
TEST_F(RanksTest, WhatRank0CannotWriteEndsAll) {
    const auto seen = play(4, "toy", Mode::kNew, [&](std::uint32_t rank, Special& special) {
        if (rank == 0)
            special.after = [&](std::size_t calls) {
                if (calls != 7) return;
                fs::remove(folder_ / "toy/metrics.jsonl");
                fs::create_directory(folder_ / "toy/metrics.jsonl");
            };
    });
    EXPECT_EQ(seen[0].letters, "..coovs");
    EXPECT_EQ(seen[0].ended.message().find("cannot "), 0U) << seen[0].ended.message();
    for (std::uint32_t rank = 1; rank < 4; ++rank) {
        EXPECT_EQ(seen[rank].ended.message(), "rank 0: " + seen[0].ended.message());
        EXPECT_EQ(seen[rank].ended.code(), Code::kIo);
    }
    const auto refused = play(2, "toy", Mode::kNew);
    expect_all(refused, &Seen::opened, Code::kInvalidState, "holds a run");
    EXPECT_EQ(refused[1].opened.message(), "rank 0: " + refused[0].opened.message());
}

TEST_F(RanksTest, ARankThatIsGoneEndsAll) {
    const auto seen = play(4, "toy", Mode::kNew, [&](std::uint32_t rank, Special& special) {
        if (rank != 3) return;
        special.most = 3;
        special.after = [&](std::size_t calls) {
            if (calls == 3) threads_->leave();
        };
    });
    for (std::uint32_t rank = 0; rank < 3; ++rank)
        EXPECT_ERROR(seen[rank].ended, Code::kIo, "a thread is gone");
    EXPECT_HAS(file("toy/log.txt"), "error: group: ");
    EXPECT_HAS(file("toy/run.json"), "\"failed\"");
    RunTest::play("whole", Mode::kNew);
    EXPECT_EQ(play(2, "toy", Mode::kResume)[0].letters.back(), 'd');
    expect_equal("whole", "toy");
}

TEST_F(RanksTest, ARunThatIsClosedEndsAll) {
    const auto seen = play(2, "toy", Mode::kNew, [](std::uint32_t rank, Special& special) {
        if (rank == 0) special.most = 8;
    });
    EXPECT_EQ(seen[1].letters, "ss");
    EXPECT_ERROR(seen[1].ended, Code::kCancelled, "rank 0: the run was closed before its end");
}

TEST_F(RanksTest, WhatDiffersIsRefusedBeforeAnythingIsWritten) {
    const auto refused = [&](Code code, const std::string& says, const Specials& specials) {
        expect_all(play(4, "toy", Mode::kNew, specials), &Seen::opened, code, says);
        EXPECT_FALSE(fs::exists(folder_ / "toy"));
    };
    refused(Code::kInvalidArgument, "rank 2: libsplat is version 1.2.4, but 1.2.3 on rank 0",
            [](std::uint32_t rank, Special& special) {
                if (rank >= 2) special.library = "1.2.4";
            });
    refused(Code::kInvalidArgument, "rank 1: the toy is a doll, but toy on rank 0",
            [](std::uint32_t rank, Special& special) {
                if (rank == 1) special.toy.data = "a doll";
            });
    refused(Code::kInvalidArgument, "rank 3: the weights to start from are not those of rank 0",
            [](std::uint32_t rank, Special& special) {
                if (rank == 3) special.toy.first = 2;
            });
    for (const std::uint32_t which : {0U, 1U})
        refused(Code::kInvalidArgument, "rank " + std::to_string(which) + ": no",
                [&](std::uint32_t rank, Special& special) {
                    if (rank == which) special.toy.refuses = "no toy";
                });
    refused(Code::kInvalidArgument, "no toy",
            [&](std::uint32_t, Special& special) { special.toy.refuses = "no toy"; });
}

TEST_F(RanksTest, AnotherDeviceIsAWarning) {
    play(4, "toy", Mode::kNew, [](std::uint32_t rank, Special& special) {
        if (rank == 2) special.toy.device = "a carpet";
    });
    EXPECT_HAS(file("toy/log.txt"),
               "warning: rank 2 computes on a carpet, but rank 0 on a table: other devices");
}

/// Every rank goes on from the state that rank 0 could read.
TEST_F(RanksTest, ADamagedStateIsSkippedByAll) {
    RunTest::play("whole", Mode::kNew);
    RunTest::play("toy", Mode::kNew);
    const fs::path state = folder_ / "toy/checkpoints/step_0000000004.state.safetensors";
    const auto none = need(io::load_weights(state.string()));
    io::WeightsFile other;
    for (io::NamedTensor tensor : none.tensors) {
        tensor.name = "doll";
        EXPECT_OK(other.tensors.add(tensor));
    }
    EXPECT_OK(io::save_weights(other, state.string()));
    const auto seen = play(4, "toy", Mode::kResume);
    EXPECT_EQ(seen[1].letters, "ssd");
    EXPECT_HAS(file("toy/log.txt"), "skipped a state: no toy");
    EXPECT_TRUE(fs::exists(state.string() + ".unreadable"));
    expect_equal("whole", "toy");
}

TEST_F(RanksTest, BeginAgainWithoutAState) {
    for (const std::size_t calls : {0U, 2U}) {
        const auto begun = play(4, "toy", Mode::kReplace,
                                [&](std::uint32_t, Special& special) { special.most = calls; });
        const auto seen = play(2, "toy", Mode::kResume);
        EXPECT_EQ(seen[1].letters, "ssssd");
        EXPECT_HAS(file("toy/log.txt"), "the run has no state yet, and begins again");
    }
    EXPECT_EQ(play(4, "toy", Mode::kResume)[1].letters, "d");
}

TEST_F(RanksTest, EndWhereNothingIsLearned) {
    const auto seen = play(4, "toy", Mode::kNew, [](std::uint32_t, Special& special) {
        special.toy.outcomes = {Outcome::kUpdated};
        special.toy.outcomes.resize(30, Outcome::kSkipped);
    });
    for (const Seen& one : seen) {
        EXPECT_EQ(one.letters.back(), 'n');
        EXPECT_HAS(one.text, "are not finite: play less");
    }
}

}  // namespace
}  // namespace splat::run
