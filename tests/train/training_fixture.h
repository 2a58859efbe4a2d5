#pragma once

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "synthetic/sample_folder.h"
#include "train/splatter_training.h"

namespace splat::train {

namespace fs = std::filesystem;
using run::Event;
using run::EventKind;
using Mode = run::RunFolder::Mode;

/// What a run is opened with.
struct Asked {
    std::string folder;
    Mode mode = Mode::kNew;
    TrainingDesc training;
};

/// A run and its task.
struct Opened {
    std::unique_ptr<run::Run> session;
    const SplatterTraining* training = nullptr;

    Status next(Event& event) const { return session->next(event); }
    [[nodiscard]] run::Figures figures() const { return session->figures(); }
};

/// A small network that learns two small cars.
class TrainingTest : public testing::Test {
  protected:
    void SetUp() override {
        context_ = std::shared_ptr<vk::Context>(test::shared_context(), [](vk::Context*) {});
        ASSERT_NE(context_, nullptr);
        cars_ = test::sample_cars(folder_ / "cars");
        test::write_all(cars_);
    }
    Asked desc(const std::string& run, std::vector<std::string> changes = {}) {
        Asked made{(folder_ / run).string(), Mode::kNew, {}};
        made.training.changes = {"data.root='" + cars_.path + "'",
                                 "data.training_resolution=16",
                                 "model.base_dim=8",
                                 "model.num_blocks=1",
                                 "model.channel_mult=[1, 2]",
                                 "model.attention_resolutions=[8]",
                                 "model.opacity_bias=0",
                                 "opt.batch_size=1",
                                 "opt.imgs_per_obj=2",
                                 "opt.base_lr=1e-3",
                                 "opt.iterations=4",
                                 "logging.ckpt_iterations=2",
                                 "logging.val_log=2",
                                 "logging.loss_log=1"};
        std::vector<std::string>& all = made.training.changes;
        all.insert(all.end(), changes.begin(), changes.end());
        return made;
    }
    Asked resumed(const std::string& run, std::vector<std::string> changes = {}) {
        Asked made{(folder_ / run).string(), Mode::kResume, {}};
        made.training.changes = std::move(changes);
        return made;
    }
    Result<Opened> try_open(const Asked& asked) {
        auto task = std::make_unique<SplatterTraining>(context_, asked.training);
        Opened opened{nullptr, task.get()};
        SPLAT_ASSIGN(opened.session, run::Run::open({asked.folder, asked.mode, "test"},
                                                    std::move(task), interrupt_));
        return opened;
    }
    std::optional<Opened> open(const Asked& asked) { return need(try_open(asked)); }
    Status refusal(const Asked& asked) { return try_open(asked).status(); }
    /// Every event until one ends the run.
    static std::vector<Event> run(const Opened& training) {
        std::vector<Event> events;
        do {
            events.emplace_back();
            EXPECT_OK(training.next(events.back()));
        } while (events.back().kind < EventKind::kDone && events.size() < 1000);
        return events;
    }
    [[nodiscard]] std::string file(const std::string& run, const std::string& name) const {
        return test::file_text(folder_ / run / name);
    }
    void expect_equal_weights(const std::string& a, const std::string& b) {
        for (const char* name : {"weights_last.safetensors", "weights_best.safetensors",
                                 "checkpoints/step_0000000004.state.safetensors"})
            EXPECT_TRUE(file(a, name) == file(b, name)) << name;
    }

    std::shared_ptr<vk::Context> context_;
    test::SampleFolder folder_;
    synthetic::WriterDesc cars_;
    Interrupt interrupt_;
};

/// NaN where it is missing.
inline double number_of(const Event& event, std::string_view name) {
    for (const run::Number& number : event.numbers)
        if (number.name == name) return number.value;
    return NAN;
}

inline std::string kinds_of(const std::vector<Event>& events) {
    constexpr const char* kLetters = ".sovcdinb";
    std::string letters;
    for (const Event& event : events) letters += kLetters[static_cast<int>(event.kind)];
    return letters;
}

inline const Event* first_of(const std::vector<Event>& events, EventKind kind) {
    for (const Event& event : events)
        if (event.kind == kind) return &event;
    return nullptr;
}

}  // namespace splat::train
