#include "fit/fit_task.h"

#include <algorithm>
#include <cmath>

#include "eval/image_scores.h"

namespace splat::fit {

FitTask::~FitTask() {
    left_->fitter = std::move(fitter_);
    if (context_->forked())
        left_.release();  // a child of the process owns nothing of the device
    else
        context_->mutex.defer(std::move(left_));
}

Status FitTask::step(run::Step& step) {
    FitStep done;
    SPLAT_TRY(on_device([&] { return fitter_->step(steps_, attempts_, done); }));
    ++attempts_;
    if (done.skipped) {
        step.outcome = run::Outcome::kSkipped;
    } else {
        ++steps_;
        if (done.drawn.visible == 0) step.outcome = run::Outcome::kDrewNothing;
    }
    step.why = "no Gaussian is visible";
    step.loss = done.loss;
    step.numbers = {{"fraction", fraction()},
                    {"psnr", -10 * std::log10(done.squared)},
                    {"gaussians", static_cast<double>(fitter_->set().count())},
                    {"pairs", static_cast<double>(done.drawn.pairs)},
                    {"raster_ms", 1e3 * done.raster_seconds},
                    {"loss_ms", 1e3 * done.loss_seconds},
                    {"update_ms", 1e3 * done.update_seconds},
                    {"grow_ms", 1e3 * done.grow_seconds}};
    step.terms = {{"l1", done.l1}, {"ssim", done.ssim}};
    return {};
}

/// Share of the fit's time that its steps so far take, by the cost model.
double FitTask::fraction() const {
    return steps_ < options_.steps ? static_cast<double>(fitter_->schedule().at(steps_).fraction)
                                   : 1;
}

std::uint32_t FitTask::degree() const {
    if (steps_ == 0) return 0;
    return fitter_->schedule().at(steps_ - 1).degree;
}

Status FitTask::begin_validation(const std::vector<run::NamedWeights>&) {
    scores_.clear();
    return {};
}

Status FitTask::validate(std::uint32_t piece, run::Piece& done) {
    const data::PosedPhoto& photo = held_out_[piece];
    auto drawn = on_device([&] { return fitter_->draw(photo.camera, degree()); });
    SPLAT_ASSIGN(done.images, std::move(drawn));
    for (float& value : done.images) value = std::clamp(value, 0.0F, 1.0F);
    const std::size_t pixels = photo.pixels.size();
    std::vector<std::uint8_t> valid(pixels);
    done.truths.resize(3 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        valid[i] = photo.pixels[i] >> 24 == 255 ? 1 : 0;
        for (std::size_t c = 0; c < 3; ++c)
            done.truths[c * pixels + i] =
                static_cast<float>(photo.pixels[i] >> (8 * c) & 255U) / 255.0F;
    }
    SPLAT_ASSIGN(
        const eval::ImageScores scores,
        eval::compare_images(done.images, done.truths, 3, photo.height, photo.width, valid));
    done.name = photo.name;
    done.scores = {{"val_psnr", scores.psnr}, {"val_ssim", scores.ssim}};
    done.views = 1;
    done.width = photo.width;
    done.height = photo.height;
    scores_.resize(piece);  // without those of a piece that is done again
    scores_.push_back({scores.psnr, scores.ssim});
    return {};
}

run::Validation FitTask::validation() const {
    ViewScores mean;
    for (const ViewScores& scores : scores_) {
        mean.psnr += scores.psnr / static_cast<double>(scores_.size());
        mean.ssim += scores.ssim / static_cast<double>(scores_.size());
    }
    return {mean.psnr,
            {{"val_ssim", mean.ssim},
             {"val_views", static_cast<double>(scores_.size())},
             {"gaussians", static_cast<double>(fitter_->set().count())}},
            {},
            format("held-out PSNR %.3f dB, SSIM %.4f on %zu views, %u Gaussians", mean.psnr,
                   mean.ssim, scores_.size(), fitter_->set().count())};
}

Result<io::WeightsFile> FitTask::state() {
    io::WeightsFile file;
    SPLAT_TRY(on_device([&] { return fitter_->save(file.tensors); }));
    file.metadata = {{"format", "libsplat state of a fit 1"},
                     {"step", std::to_string(steps_)},
                     {"attempts", std::to_string(attempts_)},
                     {"grown", std::to_string(fitter_->grown())},
                     {"crc32", std::to_string(io::crc32_of(file.tensors))}};
    return file;
}

Result<scene::Gaussians> FitTask::scene() {
    auto read = on_device([&] { return fitter_->set().scene(degree()); });
    SPLAT_ASSIGN(scene::Gaussians made, std::move(read));
    for (std::size_t i = 0; i < made.means.size(); ++i)
        made.means[i] = static_cast<float>(static_cast<double>(made.means[i]) + center_[i % 3]);
    return made;
}

Result<std::vector<run::NamedWeights>> FitTask::results() {
    SPLAT_ASSIGN(const scene::Gaussians made, scene());
    std::vector<run::NamedWeights> results(1);
    results[0].name = "gaussians";
    const auto n = static_cast<std::int64_t>(made.count());
    const auto terms = static_cast<std::int64_t>(scene::sh_coefficients(made.sh_degree));
    const auto add = [&](const char* name, std::vector<std::int64_t> dims,
                         const std::vector<float>& values) {
        io::NamedTensor tensor;
        tensor.name = name;
        tensor.dims = std::move(dims);
        tensor.values.own().assign(values.begin(), values.end());
        return results[0].file.tensors.add(std::move(tensor));
    };
    SPLAT_TRY(add("means", {n, 3}, made.means));
    SPLAT_TRY(add("log_scales", {n, 3}, made.log_scales));
    SPLAT_TRY(add("rotations", {n, 4}, made.rotations));
    SPLAT_TRY(add("opacity_logits", {n}, made.opacity_logits));
    SPLAT_TRY(add("sh", {n, terms, 3}, made.sh));
    return results;
}

std::uint64_t FitTask::peak_bytes() const {
    return context_->memory().use().peak;
}

std::string FitTask::headline(const std::string& folder) const {
    return format("fit %s: %zu photographs, %zu held out, %u Gaussians, step %llu of %llu, on %s",
                  folder.c_str(), fitted_, held_out_.size(), fitter_->set().count(), llu(steps_),
                  llu(options_.steps), context_->device().info().name.c_str());
}

void FitTask::describe(JsonWriter& json) const {
    json.newline(2).member("data_crc32", data_sum_);
    json.newline(2).member("photographs", fitted_).member("held_out", held_out_.size());
    json.newline(2).member("gaussians", fitter_->set().count());
}

}  // namespace splat::fit
