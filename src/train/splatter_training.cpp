#include "train/splatter_training.h"

#include <algorithm>
#include <cmath>

namespace splat::train {
namespace {

double psnr_of(double squared_error) {
    return -10 * std::log10(squared_error);  // infinite for equal images
}

}  // namespace

SplatterTraining::~SplatterTraining() {
    batches_.reset();
    left_->trainer = std::move(trainer_);
    left_->predictor = std::move(predictor_);
    if (context_->forked())
        left_.release();  // a child of the process owns nothing of the device
    else
        context_->mutex.defer(std::move(left_));
}

Status SplatterTraining::step(std::uint64_t most, std::deque<run::Step>& done) {
    const config::TrainConfig& config = settings_.training;
    Status status;
    if (trainer_->attempts() == told_) status = enter_next();
    std::uint64_t count = std::min<std::uint64_t>(most, config.scale_terms ? 1 : config.read_every);
    if (stage_ + 1 < config.stages.size())
        count = std::min(count, config.end_of(stage_) - trainer_->steps());
    if (trainer_->attempts() == told_)  // else a call that failed left steps to be read
        for (std::uint64_t i = 1; status.ok() && i <= count; ++i) status = attempt(i == count);
    if (trainer_->unread() > 0) {
        const Status read = context_->mutex.call([&] { return trainer_->read(); });
        if (status.ok()) status = read;
    }
    peaks_.resize(trainer_->attempts() - told_, peak_bytes());
    std::deque<TrainStep>& results = trainer_->results();
    for (; !results.empty(); results.pop_front()) {
        done.push_back(step_of(results.front()));
        done.back().progress = {results.front().step, ++told_};
        done.back().peak_bytes = peaks_.front();
        peaks_.pop_front();
    }
    return status;
}

Status SplatterTraining::attempt(bool read) {
    const auto batch = batches_->get(trainer_->attempts());
    if (!batch.ok()) return trainer_->abstain(batch.status());
    bool begun = false;
    Status ran = context_->mutex.call([&] {
        begun = true;
        return trainer_->step(batch.value().view(), read);
    });
    if (!begun) ran = trainer_->abstain(ran);
    peaks_.resize(trainer_->attempts() - told_, peak_bytes());
    return ran;
}

run::Step SplatterTraining::step_of(const TrainStep& done) const {
    run::Step step;
    if (done.skipped)
        step.outcome = run::Outcome::kSkipped;
    else if (done.visible == 0 || done.gradients_zero)
        step.outcome = run::Outcome::kDrewNothing;
    step.why = done.visible == 0 ? "no Gaussian is visible" : "all gradients are zero";
    step.loss = done.loss.total;
    step.numbers = {{"psnr", psnr_of(done.loss.squared)},
                    {"pixel_loss", done.loss.pixel},
                    {"rate", done.rate},
                    {"pairs", static_cast<double>(done.pairs)},
                    {"network_ms", 1e3 * done.network_seconds},
                    {"render_ms", 1e3 * done.render_seconds},
                    {"update_ms", 1e3 * done.update_seconds}};
    if (group() != nullptr) {
        step.numbers.push_back({"exchange_bytes", static_cast<double>(done.exchange_bytes)});
        step.numbers.push_back({"exchange_ms", 1e3 * done.exchange_seconds});
    }
    const config::TrainConfig& c = trainer_->config();
    if (!c.stages.empty()) step.numbers.push_back({"stage", static_cast<double>(stage_)});
    for (const LossTerm& term : kLossTerms)
        if (c.*term.weight > 0 && (!term.is_lpips() || done.step > c.lpips_after))
            step.terms.push_back({term.name, done.loss.of(term.name)});
    step.ledger = ledger_of(done);
    return step;
}

Status SplatterTraining::begin_validation(const std::vector<run::NamedWeights>& results) {
    scores_.clear();
    return context_->mutex.call([&]() -> Status {
        if (predictor_ == nullptr)
            SPLAT_SET(predictor_, predict::Predictor::create(*context_, settings_));
        model::LoadReport ignored;  // the rays are the trainer's own
        return predictor_->load(results.front().file, ignored);
    });
}

Status SplatterTraining::validate(std::uint32_t piece, run::Piece& done) {
    SPLAT_ASSIGN(const eval::EvaluatedViews views,
                 eval::evaluated_views(validation_->views_of(piece), predictor_->views(),
                                       settings_.training.validation_views,
                                       validation_->dataset().index().format));
    SPLAT_ASSIGN(const eval::ObjectScores scores,
                 eval::score_object(*context_, *predictor_, *validation_, piece, views, {},
                                    &done.images, &done.truths));
    done.name = scores.name;
    done.scores = {{"val_psnr", scores.novel.psnr},
                   {"val_ssim", scores.novel.ssim},
                   {"val_psnr_conditioning", scores.conditioning.psnr},
                   {"val_ssim_conditioning", scores.conditioning.ssim}};
    done.inputs = static_cast<std::uint32_t>(views.conditioning.size());
    done.views = static_cast<std::uint32_t>(views.all().size());
    done.width = done.height = settings_.network.resolution;
    scores_.resize(piece);  // without those of a piece that is done again
    scores_.push_back(scores);
    return {};
}

run::Validation SplatterTraining::validation() const {
    const eval::Scores novel = eval::mean_of(scores_, &eval::ObjectScores::novel);
    const eval::Scores inputs = eval::mean_of(scores_, &eval::ObjectScores::conditioning);
    const auto objects = static_cast<std::uint32_t>(scores_.size());
    return {novel.psnr,
            {{"val_ssim", novel.ssim},
             {"val_psnr_conditioning", inputs.psnr},
             {"val_objects", static_cast<double>(objects)},
             {"val_views", static_cast<double>(novel.views)},
             {"val_views_asked", static_cast<double>(settings_.training.validation_views)}},
            {{"val_ssim_conditioning", inputs.ssim}},
            format("validation PSNR %.3f dB, SSIM %.4f on %u novel views of %u objects (input "
                   "views %.3f dB)",
                   novel.psnr, novel.ssim, novel.views, objects, inputs.psnr)};
}

Result<io::WeightsFile> SplatterTraining::state() {
    auto made = context_->mutex.call([&] { return trainer_->checkpoint(); });
    if (made.ok()) note_stages(made.value());
    return made;
}

Result<std::vector<run::NamedWeights>> SplatterTraining::results() {
    std::vector<run::NamedWeights> results(1);
    results[0].name = "weights";
    auto averages = context_->mutex.call([&] { return trainer_->averaged_state(); });
    SPLAT_ASSIGN(results[0].file.tensors, std::move(averages));
    return results;
}

run::Progress SplatterTraining::progress() const {
    return {trainer_->steps(), trainer_->attempts()};
}

std::uint64_t SplatterTraining::peak_bytes() const {
    return context_->memory().use().peak;
}

}  // namespace splat::train
