// Trainings of several ranks, which are threads with a device each.
#include "ops/op_harness.h"
#include "run/follower.h"
#include "run/thread_group.h"
#include "train/training_fixture.h"

namespace splat::train {
namespace {

/// What a rank is given, and what became of it.
struct Rank {
    Asked asked;
    std::function<void(const Event&, Interrupt&)> after;  ///< each event
    std::function<Status(run::Work&, Event&)> next = [](run::Work& work, Event& event) {
        return work.next(event);
    };
    Status opened, ended;
    std::vector<Event> events;
};

class TrainingRanks : public TrainingTest {
  protected:
    static void SetUpTestSuite() {
        for (std::uint32_t rank = 0; rank < 4; ++rank)
            contexts_.push_back(need(vk::Context::create(test::context_desc(vk::Kernels::kCpu))));
    }
    static void TearDownTestSuite() { contexts_.clear(); }

    /// Train until the end. `prepare`: sets what is special on a rank.
    static std::vector<Rank> train(std::uint32_t count, const Asked& asked,
                                   const std::function<void(std::uint32_t, Rank&)>& prepare = {}) {
        ThreadGroup threads(count);
        std::vector<Rank> ranks(count);
        threads.run([&](const run::GroupCalls& calls) {
            run::Group group(calls);
            Rank& rank = ranks[group.rank()];
            rank.asked = asked;
            if (prepare) prepare(group.rank(), rank);
            rank.asked.training.group = &group;
            Interrupt interrupt;
            auto task =
                std::make_unique<SplatterTraining>(contexts_[group.rank()], rank.asked.training);
            std::unique_ptr<run::Work> work;
            const auto take = [&](auto opened) {
                rank.opened = opened.status();
                if (opened.ok()) work = std::move(opened.value());
            };
            if (group.leads())
                take(run::Run::open({rank.asked.folder, rank.asked.mode, "test", &group},
                                    std::move(task), interrupt));
            else
                take(run::Follower::open(group, "test", std::move(task), interrupt));
            while (work != nullptr && rank.ended.ok()) {
                Event event;
                rank.ended = rank.next(*work, event);
                if (rank.ended.ok()) rank.events.push_back(event);
                if (rank.after) rank.after(event, interrupt);
                if (event.kind >= EventKind::kDone) break;
            }
        });
        return ranks;
    }
    static std::vector<std::string> batches_of_4() { return {"opt.batch_size=4"}; }

    static inline std::vector<std::shared_ptr<vk::Context>> contexts_;
};

TEST_F(TrainingRanks, GoOnWithAnotherNumberOfRanks) {
    run(*open(desc("whole", batches_of_4())));
    const auto interrupt_after = [](std::uint32_t which, std::uint64_t step) {
        return [=](std::uint32_t number, Rank& rank) {
            if (number == which)
                rank.after = [=](const Event& event, Interrupt& interrupt) {
                    if (event.step == step) interrupt.raise();
                };
        };
    };
    for (const Rank& rank : train(2, desc("parts", batches_of_4()), interrupt_after(1, 1)))
        EXPECT_EQ(rank.events.back().kind, EventKind::kInterrupted) << rank.ended.message();
    const std::string record = file("parts", "run.json");
    EXPECT_HAS(record, "\"ranks\": 2");
    EXPECT_HAS(record, "\"reproducible\": true");
    EXPECT_HAS(file("parts", "metrics.jsonl"), "\"exchange_bytes\":");
    const auto more = train(4, resumed("parts"), interrupt_after(0, 3));
    for (const Rank& rank : more)
        EXPECT_EQ(rank.events.back().kind, EventKind::kInterrupted) << rank.ended.message();
    // Numbers of a step are the same on all ranks, except times and memory.
    EXPECT_EQ(number_of(more[3].events[0], "loss"),
              number_of(*first_of(more[0].events, EventKind::kStep), "loss"));
    run(*open(resumed("parts")));
    expect_equal_weights("whole", "parts");
}

TEST_F(TrainingRanks, GoThroughStagesTogether) {
    const std::vector<std::string> stages = {
        "opt.stages=[{iterations: 2, batch_size: 4, target_resolution: 8}, {iterations: 2, "
        "batch_size: 2, loss: l1}]"};
    run(*open(desc("whole", stages)));
    for (const Rank& rank : train(2, desc("parts", stages)))
        EXPECT_EQ(rank.events.back().kind, EventKind::kDone) << rank.ended.message();
    expect_equal_weights("whole", "parts");
    for (const Rank& rank : train(4, desc("few", stages)))
        EXPECT_ERROR(rank.opened, Code::kInvalidArgument,
                     "'opt.batch_size' is 2, expected a multiple of ranks times opt.micro_batch");
}

TEST_F(TrainingRanks, ACancelledCallEndsAll) {
    const auto ranks =
        train(2, desc("parts", batches_of_4()), [](std::uint32_t number, Rank& rank) {
            if (number == 1)
                rank.next = [](run::Work& work, Event& event) {
                    vk::DeviceMutex& mutex = contexts_[1]->mutex;
                    const vk::DeviceCall call(mutex);
                    if (work.figures().step == 2) mutex.interrupt().raise();
                    return work.next(event);
                };
        });
    for (const Rank& rank : ranks)
        EXPECT_ERROR(rank.ended, Code::kCancelled, "rank 1: splat_device_cancel cancelled");
    EXPECT_HAS(file("parts", "log.txt"), "error: rank 1: splat_device_cancel cancelled the call");
    EXPECT_TRUE(fs::exists(folder_.path() / "parts/checkpoints/step_0000000002.state.safetensors"));
}

TEST_F(TrainingRanks, RefuseWhatDiffers) {
    const std::vector<std::string> short_run = {"opt.batch_size=4", "opt.iterations=1",
                                                "logging.val_log=0"};
    run(*open(desc("other", short_run)));
    const auto refused = [&](const std::function<void(Asked&)>& change, const std::string& says) {
        const auto ranks =
            train(2, desc("run", batches_of_4()), [&](std::uint32_t number, Rank& rank) {
                if (number == 1) change(rank.asked);
            });
        for (const Rank& rank : ranks) EXPECT_ERROR(rank.opened, Code::kInvalidArgument, says);
        EXPECT_FALSE(fs::exists(folder_.path() / "run"));
    };
    refused([](Asked& asked) { asked.training.changes.emplace_back("opt.base_lr=2e-3"); },
            "rank 1: 'opt.base_lr' is 0.002, but 0.001 on rank 0");
    refused([](Asked& asked) { asked.training.changes.emplace_back("model.base_dim=16"); },
            "rank 1: 'model.base_dim' is 16, but 8 on rank 0");
    refused(
        [&](Asked& asked) {
            asked.training.init = (folder_.path() / "other/weights_last.safetensors").string();
        },
        "rank 1: the weights to start from are not those of rank 0");
    fs::copy(cars_.path, cars_.path + "_moved", fs::copy_options::recursive);
    const std::string moved = "data.root='" + cars_.path + "_moved'";
    const auto ranks = train(2, desc("run", short_run), [&](std::uint32_t number, Rank& rank) {
        if (number == 1) rank.asked.training.changes.push_back(moved);
    });
    for (const Rank& rank : ranks) EXPECT_EQ(rank.events.back().kind, EventKind::kDone);
    fs::remove_all(folder_.path() / "run");
    const fs::path objects = fs::path(cars_.path + "_moved") / "srn_cars/cars_train";
    fs::copy(fs::directory_iterator(objects)->path(), objects / "zzz", fs::copy_options::recursive);
    refused([&](Asked& asked) { asked.training.changes.push_back(moved); },
            "rank 1: the data's 'objects' is 3, but 2 on rank 0");
}

}  // namespace
}  // namespace splat::train
