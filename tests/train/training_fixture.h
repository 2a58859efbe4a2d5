#pragma once

#include <gtest/gtest.h>

#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "synthetic/sample_folder.h"
#include "train/training.h"

namespace splat::train {

namespace fs = std::filesystem;
using Mode = RunFolder::Mode;

/// A small network that learns two small cars.
class TrainingTest : public testing::Test {
  protected:
    void SetUp() override {
        context_ = std::shared_ptr<vk::Context>(test::shared_context(), [](vk::Context*) {});
        ASSERT_NE(context_, nullptr);
        cars_ = test::sample_cars(folder_.path() / "cars");
        test::write_all(cars_);
    }
    TrainingDesc desc(const std::string& run, std::vector<std::string> changes = {}) {
        TrainingDesc made;
        made.folder = (folder_.path() / run).string();
        made.changes = {"data.root='" + cars_.path + "'",
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
        made.changes.insert(made.changes.end(), changes.begin(), changes.end());
        return made;
    }
    TrainingDesc resumed(const std::string& run, std::vector<std::string> changes = {}) {
        TrainingDesc made;
        made.folder = (folder_.path() / run).string();
        made.mode = Mode::kResume;
        made.changes = std::move(changes);
        return made;
    }
    std::unique_ptr<Training> open(const TrainingDesc& given) {
        auto made = Training::open(context_, given, interrupt_);
        EXPECT_OK(made.status());
        return made.ok() ? std::move(made.value()) : nullptr;
    }
    Status refusal(const TrainingDesc& given) {
        return Training::open(context_, given, interrupt_).status();
    }
    /// Every event until one ends the run.
    static std::vector<Event> run(Training& training) {
        std::vector<Event> events;
        do {
            events.emplace_back();
            EXPECT_OK(training.next(events.back()));
        } while (events.back().kind < EventKind::kDone && events.size() < 1000);
        return events;
    }
    [[nodiscard]] std::string file(const std::string& run, const std::string& name) const {
        return test::file_text(folder_.path() / run / name);
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
