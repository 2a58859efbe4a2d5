// Run::open: the folder, its record, the latest state that can be read, earlier validations.

#include <algorithm>

#include "core/config.h"
#include "core/os/path.h"
#include "io/file.h"
#include "run/run.h"

namespace splat::run {
namespace {

/// Success, or an error that another state may not have.
bool may_be_skipped(Code code) {
    return code != Code::kCancelled && code != Code::kOutOfHostMemory &&
           code != Code::kOutOfDeviceMemory && code != Code::kDeviceLost;
}

Result<ReadText> read_text(const std::string& path) {
    SPLAT_ASSIGN(const io::Buffer text, io::read_file(path, kMaxConfigBytes));
    return ReadText{path, std::string(io::as_text(text))};
}

}  // namespace

Result<std::unique_ptr<Run>> Run::open(const RunDesc& desc, std::unique_ptr<Task> task,
                                       const Interrupt& interrupt) {
    std::unique_ptr<Run> self(new Run(desc, std::move(task), interrupt));
    const Status opened = self->open();
    if (opened.ok()) return self;
    self->leader_.fail(opened);
    return opened;
}

Status Run::open() {
    SPLAT_TRY(leader_.greet(desc_.library));
    SPLAT_SET(folder_, RunFolder::open(desc_.folder, desc_.mode));
    const bool resumed = desc_.mode == RunFolder::Mode::kResume;
    ReadText config;
    Order prepare{.what = Order::What::kPrepare};
    if (resumed) {
        SPLAT_SET(config, read_text(folder_->path("config.json")));
        prepare.texts = {config.path, config.text};
    }
    SPLAT_TRY(leader_.together(prepare, [&]() -> Status {
        SPLAT_SET(plan_, task_->prepare(resumed ? &config : nullptr, messages_));
        return {};
    }));
    SPLAT_TRY(leader_.compare(*task_, messages_));
    SPLAT_TRY(resumed ? resume() : start({}));
    Order begin_all{.what = Order::What::kBegin};
    if (!leader_.alone() && saved_ == kNotSaved) {  // a state that was loaded is the same
        SPLAT_ASSIGN(const std::string sum, checksum_of(*task_));
        begin_all.texts = {sum};
    }
    SPLAT_TRY(leader_.together(begin_all, [&] { return task_->begin(); }));
    return leader_.together({.what = Order::What::kOpen}, [&] { return begin(); });
}

/// `record`: path and text of the run.json that others have to recall.
Status Run::start(std::vector<std::string> record) {
    return leader_.together({.what = Order::What::kStart, .texts = std::move(record)},
                            [&] { return task_->start(messages_); });
}

Status Run::resume() {
    const std::string path = folder_->path("run.json");
    const auto text = read_text(path);
    JsonTree record;  // without members if it cannot be parsed
    if (text.ok())
        if (auto json = parse_json_tree(text.value().text, "run.json"); json.ok())
            record = std::move(json.value());
    const Status recalled = text.ok() ? task_->recall(record, path) : text.status();
    SPLAT_ASSIGN(const auto states, folder_->states());
    if (states.empty()) {
        if (!recalled.ok())
            return {recalled.code(), recalled.message() +
                                         "; without it a run that has no state yet cannot begin "
                                         "again: let it be overwritten"};
        messages_.push_back({"the run has no state yet, and begins again"});
        return start({path, text.value().text});
    }
    SPLAT_TRY(task_->compare(record, messages_));
    for (const auto& state : states) {
        const auto file = io::load_weights(os::text_of(state));
        const Status loaded = file.ok() ? leader_.load(file.value(), *task_) : file.status();
        SPLAT_TRY(leader_.failed());
        if (!may_be_skipped(loaded.code())) return loaded;
        if (!loaded.ok()) {
            messages_.push_back({"skipped a state: " + loaded.message(), true});
            unreadable_.push_back(state);
            continue;
        }
        const Progress progress = task_->progress();
        step_ = saved_ = begun_at_ = progress.steps;
        attempts_ = progress.attempts;
        skipped_ = progress.attempts - progress.steps;
        messages_.push_back({"resumed from " + os::text_of(state.filename())});
        return restore_validations();
    }
    return not_found("no state in '%s' can be read; to start again, let the run be overwritten",
                     folder_->path("checkpoints").c_str());
}

/// Take over the validations of the run since the latest one of another protocol than those to come.
Status Run::restore_validations() {
    bool others = false;  // was the latest one another
    SPLAT_ASSIGN(const std::vector<MetricLine> lines, folder_->metrics());
    for (const MetricLine& line : lines) {
        const std::optional<double> psnr = line.number("val_psnr");
        if (!psnr || line.step > step_) continue;
        others = plan_.pieces > 0 && std::ranges::any_of(plan_.protocol, [&](const Number& now) {
                     return line.number(now.name).value_or(now.value) != now.value;
                 });
        if (others) {
            best_psnr_ = 0;
            last_psnr_ = last_ssim_ = NAN;
            validated_ = ~std::uint64_t{0};
            continue;
        }
        last_psnr_ = *psnr;
        last_ssim_ = line.number("val_ssim").value_or(NAN);
        if (line.step > 0) best_psnr_ = std::max(best_psnr_, last_psnr_);
        if (line.step == step_) validated_ = step_;
    }
    if (!others) return {};
    std::string anew = plan_.score;
    for (const std::string& result : plan_.results)
        anew += " and " + os::text_of(os::path_of(folder_->best_path(result)).filename());
    messages_.push_back({format("warning: the validations so far saw other %s, so the best %s "
                                "begin anew",
                                plan_.protocol_text.c_str(), anew.c_str()),
                         true});
    return {};
}

Status Run::begin() {
    SPLAT_ASSIGN(const std::size_t left, folder_->begin(plan_.config, plan_.results));
    if (desc_.mode == RunFolder::Mode::kResume) SPLAT_TRY(folder_->cut_metrics(step_));
    for (const auto& state : unreadable_) SPLAT_TRY(folder_->set_aside(state));
    if (left > 0)
        messages_.push_back({format("removed %zu unfinished files that a crash left", left)});
    messages_.push_back({task_->headline(desc_.folder)});
    for (const Message& message : messages_) SPLAT_TRY(folder_->log(message.text));
    return write_run("running");
}

}  // namespace splat::run
