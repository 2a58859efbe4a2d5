#include "train/training.h"

#include <algorithm>
#include <cmath>

#include "core/json_writer.h"

namespace splat::train {
namespace {

/// A run fails after so many steps in a row whose loss or gradients are not finite.
constexpr std::uint64_t kMostSkipped = 10;

/// A warning comes after so many steps in a row that drew nothing, and a failure after ten times as many.
constexpr std::uint64_t kMostNotDrawn = 20;

constexpr std::size_t kStatesKept = 2;

unsigned long long wide(std::uint64_t number) {
    return number;
}

double psnr_of(double squared_error) {
    return -10 * std::log10(squared_error);  // infinite for equal images
}

const char* not_drawn_text(const TrainStep& step) {
    return step.visible == 0 ? "no Gaussian is visible" : "all gradients are zero";
}

bool is_nth(std::uint64_t step, std::uint64_t every) {
    return every > 0 && step % every == 0;
}

}  // namespace

Training::~Training() {
    batches_.reset();
    left_->trainer = std::move(trainer_);
    left_->predictor = std::move(predictor_);
    if (context_->forked())
        left_.release();  // a child of the process owns nothing of the device
    else
        context_->mutex.defer(std::move(left_));
}

Status Training::next(Event& event) {
    const vk::DeviceCall call(context_->mutex);
    Status done = work(event);
    if (done.code() == Code::kCancelled) return done;
    if (done.message() == error_) return done;
    error_ = done.message();
    // What cannot be written here either, as on a full disk, is in the status.
    if (!done.ok()) (void)folder_->log("error: " + error_);
    if (!ended_) (void)write_run(done.ok() ? "running" : "failed");
    return done;
}

Status Training::work(Event& event) {
    if (untold_) return tell(event);
    event = {};
    event.attempts = trainer_->attempts();
    event.step = step_;
    event.iterations = settings_.training.iterations;
    event.skipped = skipped_;
    event.best_psnr = best_psnr_;
    event.averaged_loss = averaged_loss_;
    if (!messages_.empty()) {
        std::tie(event.text, event.warning) = messages_.front();
        messages_.pop_front();
        return {};
    }
    event.peak_bytes = peak_bytes();
    event.seconds = seconds();
    if (ended_) {
        event.kind = *ended_;
        return {};
    }
    if (skipped_in_a_row_ == kMostSkipped) return end(EventKind::kNotFinite, event);
    if (not_drawn_in_a_row_ == 10 * kMostNotDrawn) return end(EventKind::kNothingDrawn, event);
    const bool last = step_ >= settings_.training.iterations;
    const bool interrupted = interrupt_.count() != raised_before_;
    const bool save_now =
        step_ == 0 || last || interrupted || is_nth(step_, settings_.training.checkpoint_every);
    if (save_now && saved_ != step_) return save(event);
    if (interrupted && (!last || is_validation_due())) return end(EventKind::kInterrupted, event);
    if (is_validation_due()) return validate(event);
    if (last) return end(EventKind::kDone, event);
    return step(event);
}

bool Training::is_validation_due() const {
    const config::TrainConfig& c = settings_.training;
    if (validation_ == nullptr || validated_ == step_ || c.iterations == 0) return false;
    return step_ >= c.iterations || is_nth(step_, c.validate_every);
}

std::uint32_t Training::validated_objects() const {
    const std::uint32_t asked = settings_.training.validation_objects;
    return asked == 0 ? validation_->objects() : std::min(asked, validation_->objects());
}

/// Write what a piece of work did, after an error again.
Status Training::tell(Event& event) {
    if (!untold_->metric.empty()) SPLAT_TRY(folder_->metric(untold_->metric));
    untold_->metric.clear();
    if (!untold_->event.text.empty()) SPLAT_TRY(folder_->log(untold_->event.text));
    event = std::move(untold_->event);
    untold_.reset();
    return {};
}

Status Training::step(Event& event) {
    SPLAT_ASSIGN(const Batch batch, batches_->get(trainer_->attempts()));
    if (!begun_) begun_ = std::chrono::steady_clock::now();
    TrainStep result;
    SPLAT_TRY(on_device([&] { return trainer_->step(batch.view(), result); }));
    return after_step(result, event);
}

Status Training::after_step(const TrainStep& result, Event& event) {
    event.kind = EventKind::kStep;
    event.result = result;
    event.attempts = trainer_->attempts();
    event.peak_bytes = peak_bytes();
    event.seconds = seconds();
    if (result.skipped) {
        event.skipped = ++skipped_;
        ++skipped_in_a_row_;
        event.warning = true;
        event.text = format("attempt %llu: loss or gradients are not finite; nothing was updated",
                            wide(event.attempts));
        untold_ = {event, ""};
        return tell(event);
    }
    skipped_in_a_row_ = 0;
    event.step = step_ = result.step;
    loss_ = result.loss.total;
    averaged_loss_ = std::isnan(averaged_loss_) ? loss_ : 0.98 * averaged_loss_ + 0.02 * loss_;
    event.averaged_loss = averaged_loss_;
    event.psnr = psnr_of(result.loss.squared);
    event.steps_per_second = static_cast<double>(step_ - begun_at_) / std::max(event.seconds, 1e-9);
    const config::TrainConfig& c = settings_.training;
    event.logged = is_nth(step_, c.log_every) || step_ == 1 || step_ == c.iterations;
    std::string metric;
    if (event.logged)
        metric = step_json(result, {event.psnr, skipped_, event.seconds, event.peak_bytes}, c);
    const bool drawn = result.visible > 0 && !result.gradients_zero;
    not_drawn_in_a_row_ = drawn ? 0 : not_drawn_in_a_row_ + 1;
    if (not_drawn_in_a_row_ == kMostNotDrawn) {
        event.warning = true;
        event.text = format(
            "warning: step %llu: %llu steps in a row drew nothing (%s); the run fails after %llu",
            wide(step_), wide(kMostNotDrawn), not_drawn_text(result), wide(10 * kMostNotDrawn));
    }
    untold_ = {event, std::move(metric)};
    return tell(event);
}

Status Training::save(Event& event) {
    for (const bool whole : {true, false}) {  // one after the other: a state is large
        io::WeightsFile file;
        const Status copied = on_device([&]() -> Status {
            if (whole) {
                SPLAT_ASSIGN(file, trainer_->checkpoint());
            } else {
                SPLAT_ASSIGN(file.tensors, trainer_->averaged_state());
            }
            return {};
        });
        SPLAT_TRY(copied);
        SPLAT_TRY(io::save_weights(
            file, whole ? folder_->state_path(step_) : folder_->path("weights_last.safetensors")));
    }
    folder_->keep_latest_states(kStatesKept);
    saved_ = step_;
    event.kind = EventKind::kCheckpoint;
    return {};
}

Status Training::begin_validation() {
    Validation made;
    const Status loaded = on_device([&]() -> Status {
        if (predictor_ == nullptr) {
            SPLAT_ASSIGN(predictor_, predict::Predictor::create(*context_, settings_));
        }
        SPLAT_ASSIGN(made.weights.tensors, trainer_->averaged_state());
        model::LoadReport ignored;  // the rays are the trainer's own
        return predictor_->load(made.weights, ignored);
    });
    SPLAT_TRY(loaded);
    validating_ = std::move(made);
    return {};
}

Status Training::validate(Event& event) {
    if (!validating_) SPLAT_TRY(begin_validation());
    const config::TrainConfig& c = settings_.training;
    event.objects = validated_objects();
    event.object = static_cast<std::uint32_t>(validating_->scores.size());
    if (event.object == event.objects) return end_validation(event);
    SPLAT_ASSIGN(const eval::EvaluatedViews views,
                 eval::evaluated_views(validation_->views_of(event.object), predictor_->views(),
                                       c.validation_views, validation_->dataset().index().format));
    SPLAT_ASSIGN(event.scores,
                 eval::score_object(*context_, *predictor_, *validation_, event.object, views, {},
                                    &event.images, &event.truths));
    event.inputs = static_cast<std::uint32_t>(views.conditioning.size());
    event.kind = EventKind::kValidatedObject;
    validating_->scores.push_back(event.scores);
    return {};
}

Status Training::end_validation(Event& event) {
    const Validation& done = *validating_;
    event.kind = EventKind::kValidation;
    event.novel = eval::mean_of(done.scores, &eval::ObjectScores::novel);
    event.conditioning = eval::mean_of(done.scores, &eval::ObjectScores::conditioning);
    const double psnr = event.novel.psnr;
    const bool best = step_ > 0 && psnr > best_psnr_;
    // Before its line of metrics, which tells a resumed run that this validation is done.
    if (best) SPLAT_TRY(io::save_weights(done.weights, folder_->path("weights_best.safetensors")));
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().member("step", step_).member("val_psnr", psnr);
    json.member("val_ssim", event.novel.ssim);
    json.member("val_psnr_conditioning", event.conditioning.psnr);
    json.member("val_objects", event.objects).member("val_views", event.novel.views);
    json.member("val_views_asked", settings_.training.validation_views).end();
    if (best) best_psnr_ = psnr;
    event.best_psnr = best_psnr_;
    last_psnr_ = psnr;
    validated_ = step_;
    validating_.reset();
    event.text = format(
        "step %llu: validation PSNR %.3f dB, SSIM %.4f on %u novel views of %u objects (input "
        "views %.3f dB)",
        wide(step_), psnr, event.novel.ssim, event.novel.views, event.objects,
        event.conditioning.psnr);
    untold_ = {event, json.text()};
    return tell(event);
}

Status Training::end(EventKind kind, Event& event) {
    std::string state, text;
    switch (kind) {
        case EventKind::kInterrupted:
            state = "interrupted";
            text = format("interrupted after step %llu; --resume continues it", wide(step_));
            break;
        case EventKind::kNotFinite:
            state = "not finite";
            text = format(
                "%llu steps in a row had a loss or gradients that are not finite: lower "
                "opt.base_lr, or look at the data ('vkrun data check'); the last good "
                "state is in checkpoints/",
                wide(kMostSkipped));
            break;
        case EventKind::kNothingDrawn:
            state = "nothing drawn";
            text = format(
                "%llu steps in a row drew nothing, so that nothing is learned: look at "
                "data.znear, data.zfar and the poses of the data, or raise "
                "model.opacity_bias and model.scale_bias",
                wide(10 * kMostNotDrawn));
            break;
        default:
            state = "done";
            text = format("done: %llu steps", wide(step_));
            if (!std::isnan(averaged_loss_)) text += format(", loss %.6f", averaged_loss_);
            if (validation_ != nullptr)
                text += format(", best validation PSNR %.2f dB", best_psnr_);
    }
    error_.clear();  // this call is not a failure
    SPLAT_TRY(write_run(state.c_str()));
    SPLAT_TRY(folder_->log(text));
    event.text = text;
    event.kind = kind;
    ended_ = kind;
    return {};
}

Status Training::write_run(const char* state) const {
    RunSurroundings run;
    run.state = state;
    run.library = library_;
    run.device = &context_->device();
    run.dataset = &data_->dataset();
    run.seed = settings_.training.seed;
    run.start = &start_;
    run.error = error_;
    for (const nn::Parameter& parameter : trainer_->model().parameters().all()) {
        const std::uint64_t count = parameter.shape.elements();
        run.parameters += count;
        if (parameter.trainable) run.trainable += count;
    }
    return folder_->write("run.json", run_json(figures(), run));
}

RunFigures Training::figures() const {
    return {folder_->path(""), step_,        settings_.training.iterations,
            skipped_,          loss_,        last_psnr_,
            best_psnr_,        peak_bytes(), trainer_->last()};
}

double Training::seconds() const {
    if (!begun_) return 0;
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - *begun_).count();
}

std::uint64_t Training::peak_bytes() const {
    return context_->memory().use().peak;
}

}  // namespace splat::train
