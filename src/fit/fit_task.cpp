#include "fit/fit_task.h"

#include <cmath>

#include "io/file.h"
#include "io/transforms_json.h"
#include "scene/camera_pose.h"

namespace splat::fit {

FitTask::~FitTask() {
    left_->fitter = std::move(fitter_);
    if (context_->forked())
        left_.release();  // a child of the process owns nothing of the device
    else
        context_->mutex.defer(std::move(left_));
}

Status FitTask::sparing(const std::function<Status()>& body) {
    for (;;) {
        const Status done = on_device(body);
        if (done.code() != Code::kOutOfDeviceMemory) return done;
        std::string how;
        SPLAT_TRY(context_->mutex.call([&]() -> Status {
            how = fitter_->spare();
            return {};
        }));
        if (how.empty()) return done;
        if (!spared_.empty()) spared_ += "; ";
        spared_ += "memory runs out: " + how;
    }
}

Status FitTask::explained(const Status& done) const {
    if (done.code() != Code::kOutOfDeviceMemory) return done;
    return {done.code(),
            format("memory for step %llu: %s; the run can be resumed where there is more",
                   llu(steps_), done.message().c_str())};
}

Status FitTask::step(std::uint64_t /*most*/, std::deque<run::Step>& steps) {
    FitStep done;
    SPLAT_TRY(explained(sparing([&] { return fitter_->step(steps_, attempts_, done); })));
    ++attempts_;
    run::Step& step = steps.emplace_back();
    step.notice = std::exchange(spared_, {});
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
    if (!options_.depth.empty() && options_.depth_weight > 0)
        step.terms.push_back({"depth", done.priors.depth});
    if (!options_.normals.empty() && options_.normal_weight > 0)
        step.terms.push_back({"normal", done.priors.normal});
    step.progress = progress();
    step.peak_bytes = peak_bytes();
    return {};
}

/// Share of the fit's time that its steps so far take, by the cost model.
double FitTask::fraction() const {
    return steps_ < options_.steps ? static_cast<double>(fitter_->schedule().at(steps_).fraction)
                                   : 1;
}

std::uint32_t FitTask::degree() const {
    return fitter_->schedule().at(steps_ > 0 ? steps_ - 1 : 0).degree;
}

Status FitTask::begin_validation(const std::vector<run::NamedWeights>&) {
    scores_.clear();
    return {};
}

Status FitTask::validate(std::uint32_t piece, run::Piece& done) {
    const data::PosedPhoto& photo = held_out_[piece];
    auto image = on_device([&] { return fitter_->draw(photo.camera, degree()); });
    SPLAT_TRY(explained(image.status()));
    SPLAT_TRY(score_photo(photo, std::move(image.value()), 0, done));
    scores_.resize(piece);  // without those of a piece that is done again
    scores_.push_back(done.scores);
    return {};
}

run::Validation FitTask::validation() const {
    run::Numbers scores = mean_scores(scores_);
    const double psnr = scores[0].value, ssim = scores[1].value;
    scores.erase(scores.begin());
    scores.push_back({"val_views", static_cast<double>(scores_.size())});
    scores.push_back({"gaussians", static_cast<double>(fitter_->set().count())});
    return {psnr,
            std::move(scores),
            {},
            format("held-out PSNR %.3f dB, SSIM %.4f on %zu views, %u Gaussians", psnr, ssim,
                   scores_.size(), fitter_->set().count())};
}

Result<io::WeightsFile> FitTask::state() {
    io::WeightsFile file;
    SPLAT_TRY(on_device([&] { return fitter_->save(file.tensors); }));
    file.metadata = {{"format", "libsplat state of a fit 1"},
                     {"step", std::to_string(steps_)},
                     {"attempts", std::to_string(attempts_)},
                     {"grown", std::to_string(fitter_->grown())},
                     {"most_gaussians", std::to_string(fitter_->spared().most_gaussians)},
                     {"step_views", std::to_string(fitter_->spared().views)},
                     {"crc32", std::to_string(io::crc32_of(file.tensors))}};
    return file;
}

Result<scene::Gaussians> FitTask::scene() {
    auto read = on_device([&] { return fitter_->set().scene(degree()); });
    SPLAT_ASSIGN(scene::Gaussians made, std::move(read));
    for (std::size_t i = 0; i < made.means.size(); ++i)
        made.means[i] =
            static_cast<float>(static_cast<double>(made.means[i]) + frame_.center[i % 3]);
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

/// Cameras of all photographs by name, in the photographs' frame.
Result<std::vector<run::NamedText>> FitTask::texts() {
    if (!options_.refine_poses) return std::vector<run::NamedText>();
    std::vector<scene::Camera> cameras;
    for (std::size_t i = 0; i < fitted_; ++i) cameras.push_back(fitter_->camera(i));
    for (const data::PosedPhoto& photo : held_out_) cameras.push_back(photo.camera);
    std::ranges::sort(cameras, {}, &scene::Camera::name);
    for (scene::Camera& camera : cameras) {
        const scene::Mat3 turn = scene::rotation_of(camera.world_to_camera);
        camera.world_to_camera = scene::make_pose(
            turn, scene::translation_of(camera.world_to_camera) - turn * frame_.center);
    }
    SPLAT_ASSIGN(const io::Buffer file, io::write_transforms_json(cameras));
    return std::vector<run::NamedText>{{"transforms.json", std::string(io::as_text(file))}};
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
    json.newline(2).key("device").begin_object();
    json.member("name", context_->device().info().name).end();
    json.newline(2).member("data_crc32", data_sum_);
    json.newline(2).member("photographs", fitted_).member("held_out", held_out_.size());
    json.newline(2).member("gaussians", fitter_->set().count());
    json.newline(2).key("estimated_bytes").begin_object();
    json.member("photographs", memory_.photographs).member("gaussians", memory_.gaussians);
    json.member("rasterizer", memory_.rasterizer).member("loss", memory_.loss);
    json.member("blocks", memory_.blocks).member("device", memory_.device());
    json.member("host", memory_.host).end();
}

}  // namespace splat::fit
