#pragma once

#include <gtest/gtest.h>

#include "run/run.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::run {

namespace fs = std::filesystem;
using Mode = RunFolder::Mode;

/// What a toy is to do, and what it may not be resumed with.
struct ToyDesc {
    std::uint64_t iterations = 4, validate_every = 2, save_every = 0;
    std::uint32_t pieces = 2;
    std::uint64_t not_finite_after = ~std::uint64_t{0};  ///< steps
    std::string data = "toy";
    std::vector<Outcome> outcomes = {
        Outcome::kUpdated};      ///< outcomes of the attempts, again and again
    std::string notice;          ///< what each step tells
    std::uint64_t together = 1;  ///< steps of a call
    std::uint64_t fails_at =
        ~std::uint64_t{0};  ///< attempts before the first step that fails, once
    Code failure = Code::kIo;
    // In a group:
    Group* group = nullptr;
    float first = 1;  ///< what a new run begins with
    std::string device = "a table", refuses;
};

/// Halves a number with every step.
class Toy : public Task {
  public:
    explicit Toy(ToyDesc desc) : desc_(std::move(desc)) {}
    Result<Plan> prepare(const ReadText* config, Messages&) override {
        if (!desc_.refuses.empty())
            return error(Code::kInvalidArgument, "%s", desc_.refuses.c_str());
        EXPECT_TRUE(config == nullptr || config->text == "{}");
        Plan plan;
        plan.config = "{}";
        plan.iterations = desc_.iterations;
        plan.log_every = 1;
        plan.validate_every = plan.save_every = desc_.validate_every;
        if (desc_.save_every > 0) plan.save_every = desc_.save_every;
        plan.pieces = desc_.pieces;
        plan.protocol = {{"val_pieces", static_cast<double>(desc_.pieces)}};
        plan.protocol_text = "numbers of pieces";
        plan.score = "toy PSNR";
        plan.results = {"toy"};
        plan.if_interrupted = "play on";
        plan.if_not_finite = "play less";
        plan.if_not_drawn = "play more";
        return plan;
    }
    Result<RankFacts> facts() override {
        return RankFacts{{{"the toy", desc_.data}}, desc_.device};
    }
    Status start(Messages& messages) override {
        value_ = desc_.first;
        messages.push_back({"starts"});
        return {};
    }
    Status recall(const JsonTree& run_json, const std::string& path) override {
        if (run_json.find("toy") != nullptr) return {};
        return error(Code::kFormat, "'%s' tells of no toy", path.c_str());
    }
    Status compare(const JsonTree& run_json, Messages&) override {
        const JsonTree* const toy = run_json.find("toy");
        if (toy == nullptr || *toy->text() == desc_.data) return {};
        return error(Code::kInvalidArgument, "another toy");
    }
    Status load(const io::WeightsFile& state) override {
        const io::NamedTensor* const saved = state.tensors.find("toy");
        if (saved == nullptr) return error(Code::kFormat, "no toy");
        value_ = saved->values[0];
        progress_ = {static_cast<std::uint64_t>(saved->values[1]),
                     static_cast<std::uint64_t>(saved->values[2])};
        return {};
    }
    Status begin() override { return {}; }
    Status step(std::uint64_t most, std::deque<Step>& done) override {
        for (std::uint64_t n = 0; n < std::min(most, desc_.together); ++n) {
            Status ready;
            if (progress_.attempts == desc_.fails_at) {
                desc_.fails_at = ~std::uint64_t{0};
                ready = {desc_.failure, "it rests"};
            }
            SPLAT_TRY(meet(ready));
            make(done.emplace_back());
        }
        return {};
    }
    Status begin_validation(const std::vector<NamedWeights>& results) override {
        validated_ = results.front().file.tensors.find("toy")->values[0];
        return {};
    }
    Status validate(std::uint32_t piece, Piece& done) override {
        done.name = "piece " + std::to_string(piece);
        done.scores = {{"val_psnr", 1 / validated_}};
        return {};
    }
    [[nodiscard]] Validation validation() const override {
        return {1 / validated_,
                {{"val_pieces", static_cast<double>(desc_.pieces)}},
                {{"more", 7}},
                "validated"};
    }
    Result<io::WeightsFile> state() override {
        return file(
            {value_, static_cast<float>(progress_.steps), static_cast<float>(progress_.attempts)});
    }
    Result<std::vector<NamedWeights>> results() override {
        SPLAT_ASSIGN(const io::WeightsFile made, file({value_}));
        return std::vector<NamedWeights>{{"toy", made}};
    }
    [[nodiscard]] Progress progress() const override { return progress_; }
    [[nodiscard]] std::uint64_t peak_bytes() const override { return 5; }
    [[nodiscard]] std::string headline(const std::string&) const override { return "plays"; }
    void describe(JsonWriter& json) const override { json.newline(2).member("toy", desc_.data); }

  private:
    /// Other ranks are at the same step with the same value.
    Status meet(const Status& ready) {
        if (desc_.group == nullptr) return ready;
        SPLAT_TRY(desc_.group->agree(ready));
        const auto mine = static_cast<float>(progress_.attempts) + value_;
        std::vector<float> all(desc_.group->count());
        SPLAT_TRY(desc_.group->gather(std::as_bytes(std::span(&mine, 1)),
                                      std::as_writable_bytes(std::span(all))));
        for (const float one : all) EXPECT_EQ(one, mine);
        return {};
    }
    void make(Step& step) {
        step.outcome = desc_.outcomes[progress_.attempts++ % desc_.outcomes.size()];
        step.why = "it slept";
        step.notice = desc_.notice;
        step.loss = value_;
        step.numbers = {{"half", value_ / 2}};
        step.ledger = {{"odd", progress_.attempts % 2 == 0 ? 0.0 : 1.0, true}};
        if (step.outcome != Outcome::kSkipped) {
            ++progress_.steps;
            value_ = progress_.steps == desc_.not_finite_after ? NAN : value_ / 2;
        }
        step.progress = progress_;
        step.peak_bytes = peak_bytes();
    }
    static Result<io::WeightsFile> file(const std::vector<float>& values) {
        io::WeightsFile made;
        io::NamedTensor toy;
        toy.name = "toy";
        toy.dims = {static_cast<std::int64_t>(values.size())};
        toy.values = values;
        SPLAT_TRY(made.tensors.add(std::move(toy)));
        return made;
    }
    ToyDesc desc_;
    Progress progress_;
    float value_ = 1, validated_ = 0;
};

/// Letters of events, by their kinds.
inline constexpr const char* kLetters = ".sovcdinb";

class RunTest : public testing::Test {
  protected:
    Result<std::unique_ptr<run::Run>> open(const std::string& name, Mode mode = Mode::kNew,
                                           ToyDesc toy = {}) {
        return run::Run::open({(folder_ / name).string(), mode, "1.2.3"},
                              std::make_unique<Toy>(std::move(toy)), interrupt_);
    }
    /// Letters of the events until the end, or `most` of them.
    static std::string play(run::Run& toy, std::size_t most = 1000) {
        std::string letters;
        Event event;
        while (event.kind < EventKind::kDone && letters.size() < most) {
            EXPECT_OK(toy.next(event));
            letters += kLetters[static_cast<int>(event.kind)];
        }
        return letters;
    }
    std::string play(const std::string& name, Mode mode, const ToyDesc& toy = {}) {
        const auto run = open(name, mode, toy);
        EXPECT_OK(run);
        return run.ok() ? play(*run.value()) : "";
    }
    [[nodiscard]] std::string file(const std::string& name) const {
        return test::file_text(folder_ / name);
    }

    test::SampleFolder folder_;
    Interrupt interrupt_;
};

}  // namespace splat::run
