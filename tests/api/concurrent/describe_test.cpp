// Describing an object beside a call on it, on another thread: what the thread sanitizer is for.
#include <atomic>
#include <thread>

#include "api/raster_calls.h"

namespace splat::test {
namespace {

/// Calls `describe()` on another thread until `work()` has returned.
template <class Describe, class Work>
void beside(Describe&& describe, Work&& work) {
    std::atomic<bool> done = false;
    std::atomic<int> calls = 0;
    std::jthread other([&] {
        while (!done) {
            describe();
            ++calls;
        }
    });
    while (calls == 0) std::this_thread::yield();
    work();
    done = true;
}

/// The whole number behind a key of JSON text.
long number_in(const std::string& json, const std::string& key) {
    const std::size_t at = json.find("\"" + key + "\": ");
    EXPECT_NE(at, std::string::npos) << json;
    return at == std::string::npos ? -1 : std::stol(json.substr(at + key.size() + 4));
}

/// In one call: the text may change between two.
template <class Handle>
std::string report_of(splat_result (*report)(Handle, char*, std::size_t, std::size_t*),
                      Handle handle) {
    std::string text(std::size_t{1} << 16, '\0');
    std::size_t needed = 0;
    EXPECT_DONE(report(handle, text.data(), text.size(), &needed));
    text.resize(needed - 1);
    return text;
}

TEST(ApiDescribe, AnEvaluatorThatScores) {
    const Device device = open_device();
    const Dataset dataset = make_training_dataset();
    const Predictor predictor = make_predictor(device);
    auto desc = sized<splat_evaluator_desc>();
    desc.dataset = dataset;
    desc.predictor = predictor;
    const Evaluator evaluator = got(splat_evaluator_create, &desc);
    std::uint32_t last = 0;
    const auto describe = [&] {
        const auto info = got(splat_evaluator_get_info, evaluator);
        EXPECT_GE(info.scored, last);
        const auto summary = got(splat_evaluator_summary, evaluator);
        EXPECT_GE(summary.objects, info.scored);
        EXPECT_EQ(summary.ledger.gaussians, summary.objects * std::uint64_t{256});
        last = summary.objects;
        EXPECT_GE(number_in(report_of(splat_evaluator_report, evaluator.get()), "perfect_views"),
                  0);
    };
    beside(describe, [&] {
        for (int round = 0; round < 3; ++round)
            for (const std::uint32_t object : {0U, 1U})
                EXPECT_DONE(splat_evaluator_score(evaluator, object, nullptr));
    });
    describe();
    EXPECT_EQ(last, 2U);
}

TEST(ApiDescribe, ATrainerThatSteps) {
    const Device device = open_device();
    const Trainer trainer = make_trainer(device);
    const Model model = got(splat_trainer_model, trainer);
    ASSERT_DONE(splat_model_init(model, 1));
    const TrainerBatch batch;
    const splat_trainer_batch given = batch.desc();
    long last = 0;
    const auto describe = [&] {
        const std::string report = report_of(splat_trainer_report, trainer.get());
        const long step = number_in(report, "step");
        EXPECT_GE(step, last);
        EXPECT_EQ(number_in(report, "attempts"), step);
        last = step;
        EXPECT_GT(number_in(report_of(splat_model_report, model.get()), "parameters"), 0);
        got(splat_model_get_info, model);
    };
    beside(describe, [&] {
        for (int step = 0; step < 4; ++step) got(splat_trainer_step, trainer, given);
    });
    describe();
    EXPECT_EQ(last, 4);
    const std::string state = bytes_of(splat_trainer_save_memory, trainer);
    const Trainer other = make_trainer(device);
    ASSERT_DONE(splat_trainer_resume_memory(other, state.data(), state.size()));
    EXPECT_EQ(number_in(report_of(splat_trainer_report, other.get()), "step"), 4);
}

TEST(ApiDescribe, ATrainingThatGoesOn) {
    const Device device = open_device();
    const Training training = make_training(device);
    long last = 0;
    const auto describe = [&] {
        const long step = number_in(report_of(splat_run_report, training.get()), "step");
        EXPECT_GE(step, last);
        last = step;
    };
    beside(describe, [&] {
        auto event = sized<splat_run_event>();
        while (event.kind < SPLAT_EVENT_DONE) ASSERT_DONE(splat_run_next(training, &event));
    });
    describe();
    EXPECT_EQ(last, 2);
}

TEST(ApiDescribe, ANetworkThatRuns) {
    const Device device = open_device();
    const Model model = make_model(device);
    ASSERT_DONE(splat_model_init(model, 1));
    const Module module = make_module(device);
    const Floats image(3 * 256, 0.5F);
    auto input = sized<splat_model_input>();
    input.images = image.data();
    const auto describe = [&] {
        EXPECT_GE(number_in(report_of(splat_model_report, model.get()), "prepared"), 0);
        EXPECT_GE(number_in(report_of(splat_module_report, module.get()), "bytes"), 0);
    };
    beside(describe, [&] {
        for (int pass = 0; pass < 4; ++pass) {
            EXPECT_DONE(splat_model_forward(model, &input));
            EXPECT_DONE(splat_module_forward(module));
        }
    });
}

}  // namespace
}  // namespace splat::test
