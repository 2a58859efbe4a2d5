#include "run/run.h"

#include <algorithm>

#include "core/os/path.h"

namespace splat::run {
namespace {

/// A run fails after so many steps in a row whose loss or gradients are not finite.
constexpr std::uint64_t kMostSkipped = 10;

/// A warning comes after so many steps in a row that drew nothing, and a failure after ten times as many.
constexpr std::uint64_t kMostNotDrawn = 20;

constexpr std::size_t kStatesKept = 2;

unsigned long long wide(std::uint64_t number) {
    return number;
}

bool is_nth(std::uint64_t step, std::uint64_t every) {
    return every > 0 && step % every == 0;
}

void append(Numbers& to, const Numbers& more) {
    to.insert(to.end(), more.begin(), more.end());
}

bool is_finite(const io::NamedTensors& tensors) {
    return std::ranges::all_of(tensors, [](const io::NamedTensor& tensor) {
        return std::ranges::all_of(tensor.values, [](float value) { return std::isfinite(value); });
    });
}

/// The line of metrics.jsonl for a step.
std::string step_json(const Step& step, const Event& event) {
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().member("step", event.step).member("loss", step.loss);
    add_members(json, step.numbers);
    json.member("skipped", event.skipped).member("seconds", event.seconds);
    json.member("peak_bytes", event.peak_bytes);
    add_members(json, step.terms);
    add_members(json, step.ledger);
    return json.end().text();
}

void add_figures(JsonWriter& json, const Figures& figures) {
    json.newline(2).member("schema", 1).newline(2).member("folder", figures.folder);
    json.newline(2).member("step", figures.step);
    json.newline(2).member("iterations", figures.iterations);
    json.newline(2).member("skipped", figures.skipped).newline(2).member("loss", figures.loss);
    json.newline(2).member("val_psnr", figures.validation_psnr);
    json.newline(2).member("val_ssim", figures.validation_ssim);
    json.newline(2).member("best_val_psnr", figures.best_validation_psnr);
    json.newline(2).member("peak_bytes", figures.peak_bytes).newline(2);
    add_ledger(json, figures.ledger);
}

}  // namespace

void add_members(JsonWriter& json, const Numbers& numbers) {
    for (const Number& number : numbers) {
        json.key(number.name);
        number.is_flag ? json.value(number.value != 0) : json.value(number.value);
    }
}

void add_ledger(JsonWriter& json, const std::optional<Numbers>& ledger) {
    json.key("ledger");
    if (!ledger) {
        json.raw("null");
        return;
    }
    json.begin_object();
    add_members(json, *ledger);
    json.end();
}

std::string figures_json(const Figures& figures) {
    JsonWriter json;
    json.begin_object();
    add_figures(json, figures);
    return json.newline().end().text();
}

Status Run::next(Event& event) {
    Status done = work(event);
    if (!done.ok()) leader_.fail(done);
    if (done.code() == Code::kCancelled && leader_.alone()) return done;
    if (done.message() == error_) return done;
    error_ = done.message();
    // What cannot be written here either, as on a full disk, is in the status.
    if (!done.ok()) (void)folder_->log("error: " + error_);
    if (!ended_) (void)write_run(done.ok() ? "running" : "failed");
    return done;
}

Status Run::work(Event& event) {
    if (untold_) return tell(event);
    if (done_.empty()) SPLAT_TRY(leader_.failed());
    event = {};
    event.attempts = attempts_;
    event.step = step_;
    event.iterations = plan_.iterations;
    event.skipped = skipped_;
    if (!messages_.empty()) {
        event.text = messages_.front().text;
        event.warning = messages_.front().warning;
        messages_.pop_front();
        return {};
    }
    event.peak_bytes = task_->peak_bytes();
    event.seconds = seconds();
    if (ended_) {
        event.kind = *ended_;
        return {};
    }
    if (skipped_in_a_row_ == kMostSkipped) return end(EventKind::kNotFinite, event);
    if (not_drawn_in_a_row_ == 10 * kMostNotDrawn) return end(EventKind::kNothingDrawn, event);
    if (!done_.empty() || task_->progress().attempts > attempts_) return step(event);
    const bool last = step_ >= plan_.iterations;
    const bool interrupted = interrupt_.count() != raised_before_ || leader_.interrupted();
    const bool save_now = step_ == 0 || last || interrupted || is_nth(step_, plan_.save_every);
    if (save_now && saved_ != step_) return save(event);
    if (interrupted && (!last || is_validation_due())) return end(EventKind::kInterrupted, event);
    if (is_validation_due()) return validate(event);
    if (last) return end(EventKind::kDone, event);
    return step(event);
}

bool Run::is_validation_due() const {
    if (plan_.pieces == 0 || validated_ == step_ || plan_.iterations == 0) return false;
    return step_ >= plan_.iterations || is_nth(step_, plan_.validate_every);
}

/// Write what a piece of work did, after an error again.
Status Run::tell(Event& event) {
    if (!untold_->metric.empty()) SPLAT_TRY(folder_->metric(untold_->metric));
    untold_->metric.clear();
    if (!untold_->event.text.empty()) SPLAT_TRY(folder_->log(untold_->event.text));
    event = std::move(untold_->event);
    untold_.reset();
    return {};
}

Status Run::step(Event& event) {
    if (done_.empty()) {
        const Stopwatch begins;
        const Status ran =
            leader_.together({.what = Order::What::kStep, .number = most_steps()},
                             [&, most = most_steps()] { return task_->step(most, done_); });
        if (!begun_ && !done_.empty()) begun_ = begins;
        each_seconds_ =
            begins.seconds() / static_cast<double>(std::max<std::size_t>(done_.size(), 1));
        // Another error comes again after the steps before it.
        const bool at_once = ran.code() == Code::kCancelled && leader_.alone();
        if (!ran.ok() && (done_.empty() || at_once)) return ran;
    }
    SPLAT_ASSERT(!done_.empty());
    const Step done = std::move(done_.front());
    done_.pop_front();
    return after_step(done, event);
}

/// Updates until something else is due, or until as many drew nothing as end the run. A step that is skipped is no
/// update, so as many steps do not go beyond that.
std::uint64_t Run::most_steps() const {
    std::uint64_t most = 10 * kMostNotDrawn - not_drawn_in_a_row_;
    most = std::min(most, plan_.iterations - std::min(step_, plan_.iterations - 1));
    for (const std::uint64_t every :
         {plan_.save_every, plan_.pieces > 0 ? plan_.validate_every : 0})
        if (every > 0) most = std::min(most, every - step_ % every);
    return most;
}

Status Run::after_step(const Step& done, Event& event) {
    event.kind = EventKind::kStep;
    event.attempts = attempts_ = done.progress.attempts;
    event.peak_bytes = done.peak_bytes;
    event.seconds = seconds() - each_seconds_ * static_cast<double>(done_.size());
    event.updated = done.outcome != Outcome::kSkipped;
    ledger_ = done.ledger;
    std::string metric;
    if (event.updated) {
        skipped_in_a_row_ = 0;
        event.step = step_ = done.progress.steps;
        loss_ = done.loss;
        averaged_loss_ = std::isnan(averaged_loss_) ? loss_ : 0.98 * averaged_loss_ + 0.02 * loss_;
        event.steps_per_second =
            static_cast<double>(step_ - begun_at_) / std::max(event.seconds, 1e-9);
        event.logged = is_nth(step_, plan_.log_every) || step_ == 1 || step_ == plan_.iterations;
        if (event.logged) metric = step_json(done, event);
        not_drawn_in_a_row_ = done.outcome == Outcome::kUpdated ? 0 : not_drawn_in_a_row_ + 1;
        event.warning = not_drawn_in_a_row_ == kMostNotDrawn;
        if (event.warning)
            event.text = format(
                "warning: step %llu: %llu steps in a row drew nothing (%s); the run fails after "
                "%llu",
                wide(step_), wide(kMostNotDrawn), done.why, wide(10 * kMostNotDrawn));
    } else {
        event.skipped = ++skipped_;
        ++skipped_in_a_row_;
        event.warning = true;
        event.text = format("attempt %llu: loss or gradients are not finite; nothing was updated",
                            wide(event.attempts));
    }
    if (!done.notice.empty()) {
        event.warning = true;
        event.text = event.text.empty()
                         ? format("warning: step %llu: %s", wide(step_), done.notice.c_str())
                         : event.text + "; " + done.notice;
    }
    event.numbers = {{"loss", done.loss}, {"averaged_loss", averaged_loss_}};
    for (const Numbers* more : {&done.numbers, &done.terms, &done.ledger})
        append(event.numbers, *more);
    untold_ = {event, std::move(metric)};
    return tell(event);
}

Status Run::save(Event& event) {
    {  // one after the other: a state is large
        SPLAT_ASSIGN(const io::WeightsFile state, task_->state());
        if (saved_ != kNotSaved && !is_finite(state.tensors))
            return end(EventKind::kNotFinite, event);
        SPLAT_TRY(io::save_weights(state, folder_->state_path(step_)));
    }
    SPLAT_ASSIGN(const auto results, task_->results());
    for (const NamedWeights& result : results)
        SPLAT_TRY(io::save_weights(result.file, folder_->last_path(result.name)));
    SPLAT_ASSIGN(const std::vector<NamedText> texts, task_->texts());
    for (const NamedText& file : texts) SPLAT_TRY(folder_->write(file.name, file.text));
    folder_->keep_latest_states(kStatesKept);
    saved_ = step_;
    event.kind = EventKind::kCheckpoint;
    return {};
}

Status Run::validate(Event& event) {
    if (!validated_results_) {
        SPLAT_ASSIGN(auto results, task_->results());
        SPLAT_TRY(task_->begin_validation(results));
        validated_results_ = std::move(results);
        piece_ = 0;
    }
    event.pieces = plan_.pieces;
    event.piece = piece_;
    if (piece_ == plan_.pieces) return end_validation(event);
    SPLAT_TRY(task_->validate(piece_, event.validated));
    SPLAT_TRY(leader_.together({}, [] { return Status(); }));  // how long others wait
    event.numbers = event.validated.scores;
    event.kind = EventKind::kValidatedPiece;
    ++piece_;
    return {};
}

Status Run::end_validation(Event& event) {
    const Validation found = task_->validation();
    event.kind = EventKind::kValidation;
    const bool best = step_ > 0 && found.psnr > best_psnr_;
    // Before its line of metrics, which tells a resumed run that this validation is done.
    for (const NamedWeights& result : *validated_results_)
        if (best) SPLAT_TRY(io::save_weights(result.file, folder_->best_path(result.name)));
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().member("step", step_).member("val_psnr", found.psnr);
    add_members(json, found.scores);
    json.end();
    if (best) best_psnr_ = found.psnr;
    last_psnr_ = found.psnr;
    last_ssim_ = NAN;
    for (const Number& score : found.scores)
        if (score.name == std::string_view("val_ssim")) last_ssim_ = score.value;
    validated_ = step_;
    validated_results_.reset();
    event.numbers = {{"val_psnr", found.psnr}, {"best_val_psnr", best_psnr_}};
    for (const Numbers* more : {&found.scores, &found.more}) append(event.numbers, *more);
    event.text = format("step %llu: %s", wide(step_), found.text.c_str());
    untold_ = {event, json.text()};
    return tell(event);
}

/// Give the task the latest state that can be read; what is saved is finite. Errors: kCancelled, and those of the log.
Status Run::go_back() {
    const auto states = folder_->states();
    if (!states.ok()) return folder_->log("error: " + states.status().message());
    for (const auto& state : states.value()) {
        const auto file = io::load_weights(os::text_of(state));
        const Status loaded = file.ok() ? leader_.load(file.value(), *task_) : file.status();
        SPLAT_TRY(leader_.failed());
        if (loaded.code() == Code::kCancelled) return loaded;
        if (loaded.ok()) {
            step_ = task_->progress().steps;
            attempts_ = task_->progress().attempts;
            return {};
        }
        SPLAT_TRY(folder_->log("skipped a state: " + loaded.message()));
    }
    return {};
}

Status Run::end(EventKind kind, Event& event) {
    std::string state, text;
    switch (kind) {
        case EventKind::kInterrupted:
            state = "interrupted";
            text = format("interrupted after step %llu; %s", wide(step_),
                          plan_.if_interrupted.c_str());
            break;
        case EventKind::kNotFinite:
            state = "not finite";
            text = skipped_in_a_row_ == kMostSkipped
                       ? format("%llu steps in a row had a loss or gradients that are not finite",
                                wide(kMostSkipped))
                       : format("what step %llu learned is not finite", wide(step_));
            done_.clear();
            SPLAT_TRY(go_back());
            text +=
                format(": %s; the last good state is in checkpoints/", plan_.if_not_finite.c_str());
            break;
        case EventKind::kNothingDrawn:
            state = "nothing drawn";
            text = format("%llu steps in a row drew nothing, so that nothing is learned: %s",
                          wide(10 * kMostNotDrawn), plan_.if_not_drawn.c_str());
            break;
        default:
            state = "done";
            text = format("done: %llu steps", wide(step_));
            if (!std::isnan(averaged_loss_)) text += format(", loss %.6f", averaged_loss_);
            if (plan_.pieces > 0)
                text += format(", best %s %.2f dB", plan_.score.c_str(), best_psnr_);
    }
    error_.clear();  // this call is not a failure
    SPLAT_TRY(write_run(state.c_str()));
    SPLAT_TRY(folder_->log(text));
    event.text = text;
    event.kind = kind;
    ended_ = kind;
    return leader_.end(static_cast<std::int32_t>(kind), text);
}

Status Run::write_run(const char* state) const {
    JsonWriter json;
    json.begin_object();
    add_figures(json, figures());
    json.newline(2).member("state", state).newline(2).member("library", desc_.library);
    task_->describe(json);
    if (!error_.empty()) json.newline(2).member("error", error_);
    return folder_->write("run.json", json.newline().end().text() + "\n");
}

Figures Run::figures() const {
    return {.folder = folder_->path(""),
            .step = step_,
            .iterations = plan_.iterations,
            .skipped = skipped_,
            .loss = loss_,
            .validation_psnr = last_psnr_,
            .validation_ssim = last_ssim_,
            .best_validation_psnr = best_psnr_,
            .peak_bytes = task_->peak_bytes(),
            .ledger = ledger_};
}

double Run::seconds() const {
    return begun_ ? begun_->seconds() : 0;
}

}  // namespace splat::run
