#include "vkrun/train/training_run.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/picture.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/image_channels.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/data/view_source.h"
#include "vkrun/train/run_report.h"
#include "vkrun/weights/model_load.h"

namespace vkrun {
namespace {

/// A run ends after so many steps in a row whose loss or gradients are not finite.
constexpr std::uint64_t kMostSkipped = 10;

/// Objects that a validation draws, and views of each.
constexpr std::uint32_t kShownObjects = 4, kShownViews = 3;

double psnr_of(double squared_error) {
    return squared_error > 0 ? -10 * std::log10(squared_error) : 0;
}

}  // namespace

TrainingRun::TrainingRun(const TrainingOptions& options) {
    RunFolder::check(options.out, options.resume, options.overwrite);
    config_ = merged_config(options.resume ? options.out + "/config.json" : options.config,
                            options.changes);
    if (!options.data.empty()) config_["data"]["root"] = options.data;
    iterations_ = config_.at("opt").at("iterations");
    open_data();
    device_ = open_device(device_desc(options.device));
    const std::string text = config_.dump();
    auto desc = sized<splat_trainer_desc>();
    desc.config = text.c_str();
    check(splat_trainer_create(device_.get(), &desc, trainer_.out()), kUsageError);
    check(splat_trainer_model(trainer_.get(), model_.out()));
    folder_ = std::make_unique<RunFolder>(options.out, options.resume);
    if (options.resume)
        resume();
    else
        start(options);
    replace_file(folder_->path("config.json"), config_.dump(2) + "\n");
    board_ = std::make_unique<TensorBoard>(folder_->path("tb").string());
    bar_ = isatty(STDERR_FILENO) != 0;
    const splat_device_info device = info_of(device_.get());
    const Json report = library_json(splat_trainer_report, trainer_.get());
    folder_->log(
        format("training %s: %llu of %llu parameters, %u objects, step %llu of %llu, on %s",
               options.out.c_str(),
               static_cast<unsigned long long>(report.at("trainable").get<std::uint64_t>()),
               static_cast<unsigned long long>(report.at("parameters").get<std::uint64_t>()),
               data_->objects(), static_cast<unsigned long long>(step_),
               static_cast<unsigned long long>(iterations_), device.name));
    write_run("running");
}

void TrainingRun::open_data() {
    data_ = std::make_unique<ViewSource>(config_, "", "train");
    const std::uint32_t inputs = config_.at("data").at("input_images");
    for (std::uint32_t i = 0; i < data_->objects(); ++i)
        if (data_->views_of(i) < inputs + 1)
            throw Failure(kBadData, format("object '%s' has %u views, expected at least %u",
                                           data_->name(i).c_str(), data_->views_of(i), inputs + 1));
    try {
        validation_ = std::make_unique<ViewSource>(config_, "", "val");
    } catch (const Failure& failure) {
        std::fprintf(stderr, "no validation: %s\n", failure.what());
    }
}

void TrainingRun::start(const TrainingOptions& options) {
    check(splat_model_init(model_.get(), config_.at("general").at("random_seed")));
    if (!options.init.empty()) {
        const Weights weights = load_weights(options.init);
        check(splat_model_load(model_.get(), weights.get(),
                               graft_flags("--init-channels", options.init_channels)),
              kBadData);
        const Json report = library_json(splat_model_report, model_.get());
        folder_->log("started from " + options.init + ": " + load_counts(report.at("load")));
        if (const auto sentence = rays_sentence(options.init, weights.get(), report);
            !sentence.empty())
            folder_->log("warning: " + sentence);
    }
}

void TrainingRun::resume() {
    for (const auto& path : folder_->states()) {
        if (splat_trainer_resume(trainer_.get(), path.c_str()) != SPLAT_OK) {
            folder_->log(std::string("skipped a state: ") + splat_last_error_message());
            continue;
        }
        const Json report = library_json(splat_trainer_report, trainer_.get());
        step_ = saved_ = report.at("step");
        attempts_ = report.at("attempts");
        skipped_ = attempts_ - step_;
        for (const Json& line : RunFolder::metrics(folder_->path("")))
            if (line.contains("val_psnr") && line.at("val_psnr").is_number() &&
                line.at("step").get<std::uint64_t>() <= step_)
                best_psnr_ = std::max(best_psnr_, line.at("val_psnr").get<double>());
        folder_->cut_metrics(step_);
        folder_->log("resumed from " + path.filename().string());
        return;
    }
    throw Failure(kBadData, "--resume: no state in '" + folder_->path("checkpoints").string() +
                                "' can be read; --overwrite starts again");
}

std::uint64_t TrainingRun::setting(const char* name) const {
    return config_.at("logging").at(name);
}

TrainingEnd TrainingRun::run(const std::function<bool()>& stop) {
    BatchShape shape;
    shape.objects = config_.at("opt").at("batch_size");
    shape.targets = config_.at("opt").at("imgs_per_obj");
    shape.views = config_.at("data").at("input_images");
    shape.seed = config_.at("general").at("random_seed");
    shape.focals = config_.at("data").at("fov") == 0;
    const BatchSource source(*data_, ImageChannels::of(config_), shape);
    Prefetch batches(source, attempts_, 2);
    watch_ = Stopwatch();
    begun_at_ = step_;
    if (!stop() && step_ == 0 && iterations_ > 0 && validation_) validate(0);
    while (step_ < iterations_) {
        const Batch batch = batches.next();
        const splat_trainer_batch desc = batch.desc();
        auto info = sized<splat_trainer_info>();
        check(splat_trainer_step(trainer_.get(), &desc, &info));
        ++attempts_;
        after_step(info);
        if (skipped_in_a_row_ == kMostSkipped) {
            write_run("not finite");
            folder_->log(
                format("%llu steps in a row had a loss or gradients that are not finite: "
                       "lower opt.base_lr, or look at the data ('vkrun data check'); the "
                       "last good state is in checkpoints/",
                       static_cast<unsigned long long>(kMostSkipped)));
            return TrainingEnd::kNotFinite;
        }
        if (stop()) {
            save_state();
            write_run("interrupted");
            folder_->log(format("interrupted after step %llu; --resume continues it",
                                static_cast<unsigned long long>(step_)));
            return TrainingEnd::kInterrupted;
        }
    }
    save_state();
    write_run("done");
    write_run_report({folder_->path("run.json").parent_path().string()}, "");
    folder_->log(format(
        "done: %llu steps, loss %.6f%s", static_cast<unsigned long long>(step_), averaged_loss_,
        validation_ ? format(", best validation PSNR %.2f dB", best_psnr_).c_str() : ""));
    return TrainingEnd::kDone;
}

void TrainingRun::after_step(const splat_trainer_info& info) {
    if (info.skipped != 0) {
        ++skipped_;
        ++skipped_in_a_row_;
        folder_->log(format("attempt %llu: loss or gradients are not finite; nothing was updated",
                            static_cast<unsigned long long>(attempts_)));
        return;
    }
    skipped_in_a_row_ = 0;
    step_ = info.step;
    loss_ = info.loss;
    averaged_loss_ = averaged_loss_ == 0 ? info.loss : 0.98 * averaged_loss_ + 0.02 * info.loss;
    const auto due = [&](const char* name) {
        const std::uint64_t every = setting(name);
        return every > 0 && step_ % every == 0;
    };
    if (due("loss_log") || step_ == 1 || step_ == iterations_) say(info);
    show_progress(info);
    if (validation_ && (due("val_log") || step_ == iterations_)) validate(step_);
    if (due("ckpt_iterations")) save_state();
}

void TrainingRun::say(const splat_trainer_info& info) {
    const double psnr = psnr_of(info.squared_error);
    Json metric = {{"step", info.step},
                   {"loss", info.loss},
                   {"psnr", psnr},
                   {"pixel_loss", info.pixel_loss},
                   {"pairs", info.pairs},
                   {"network_ms", info.network_ms},
                   {"render_ms", info.render_ms},
                   {"update_ms", info.update_ms},
                   {"skipped", skipped_},
                   {"seconds", watch_.seconds()},
                   {"peak_bytes", memory().peak_bytes}};
    const Json& opt = config_.at("opt");
    if (opt.at("lambda_ssim").get<double>() > 0) metric["ssim"] = info.ssim;
    if (opt.at("lambda_lpips").get<double>() > 0 &&
        info.step > opt.at("start_lpips_after").get<std::uint64_t>())
        metric["lpips"] = info.lpips;
    folder_->metric(metric);
    board_->scalars(info.step, {{"train/loss", info.loss}, {"train/psnr", psnr}});
    if (bar_) return;
    std::fprintf(stderr,
                 "step %llu/%llu: loss %.6f, PSNR %.2f dB, %.0f ms (network %.0f, render %.0f, "
                 "update %.0f), device memory at most %s\n",
                 static_cast<unsigned long long>(info.step),
                 static_cast<unsigned long long>(iterations_), info.loss, psnr,
                 info.network_ms + info.render_ms + info.update_ms, info.network_ms, info.render_ms,
                 info.update_ms, bytes_text(memory().peak_bytes).c_str());
}

splat_memory_info TrainingRun::memory() const {
    auto info = sized<splat_memory_info>();
    check(splat_device_get_memory(device_.get(), &info));
    return info;
}

void TrainingRun::show_progress(const splat_trainer_info& info) {
    if (!bar_) return;
    const double rate = static_cast<double>(step_ - begun_at_) / std::max(watch_.seconds(), 1e-9);
    const double left = static_cast<double>(iterations_ - step_) / std::max(rate, 1e-9);
    std::fprintf(stderr,
                 "\rstep %llu/%llu  loss %.5f  PSNR %.2f  %.2f steps/s  %.0f s left  %s\033[K",
                 static_cast<unsigned long long>(step_),
                 static_cast<unsigned long long>(iterations_), averaged_loss_,
                 psnr_of(info.squared_error), rate, left, bytes_text(memory().peak_bytes).c_str());
    if (step_ == iterations_) std::fputs("\n", stderr);
    std::fflush(stderr);
}

void TrainingRun::save_state() {
    if (saved_ == step_) return;
    check(splat_trainer_save(trainer_.get(), folder_->state_path(step_).c_str()));
    Weights weights;
    check(splat_trainer_store(trainer_.get(), weights.out()));
    check(splat_weights_save(weights.get(), folder_->path("weights_last.safetensors").c_str(), 0));
    folder_->keep_latest_states(2);
    saved_ = step_;
}

void TrainingRun::validate(std::uint64_t step) {
    if (network_ == nullptr) network_ = std::make_unique<Network>(device_.get(), config_);
    Weights weights;
    check(splat_trainer_store(trainer_.get(), weights.out()));
    network_->load(weights.get());
    std::uint32_t count = validation_->objects();
    if (const std::uint64_t most = setting("val_objects"); most > 0)
        count = std::min(count, static_cast<std::uint32_t>(most));
    const auto views = static_cast<std::uint32_t>(setting("val_views"));
    std::vector<ObjectScores> scores;
    std::vector<std::vector<float>> kept;
    std::vector<const float*> cells;
    const std::uint32_t side = network_->resolution();
    const std::size_t plane = std::size_t{3} * side * side;
    NetworkPredictor predictor(*network_);
    for (std::uint32_t object = 0; object < count; ++object) {
        const EvaluatedViews which =
            evaluated_views(validation_->views_of(object), network_->views(), views);
        std::vector<float> images, truths;
        scores.push_back(score_object(predictor, network_->channels(), *validation_, object, which,
                                      nullptr, &images, &truths));
        if (object >= kShownObjects) continue;
        std::vector<float> errors(images.size());  // white where there is none
        for (std::size_t i = 0; i < errors.size(); ++i)
            errors[i] = 1 - std::abs(images[i] - truths[i]);
        cells.push_back(truths.data());
        for (std::size_t i = 0; i < kShownViews; ++i) {
            const std::size_t view =
                which.conditioning.size() + i * which.novel.size() / kShownViews;
            for (const std::vector<float>* shown : {&truths, &images, &errors})
                cells.push_back(shown->data() + view * plane);
        }
        for (std::vector<float>* shown : {&truths, &images, &errors})
            kept.push_back(std::move(*shown));
    }
    contact_sheet(cells, side, 1 + 3 * kShownViews)
        .save(folder_->path("renders").string() +
              format("/step_%08llu.png", static_cast<unsigned long long>(step)));
    const Scores novel = mean_of(scores, &ObjectScores::novel);
    const Scores conditioning = mean_of(scores, &ObjectScores::conditioning);
    last_psnr_ = novel.psnr;
    folder_->metric({{"step", step},
                     {"val_psnr", novel.psnr},
                     {"val_ssim", novel.ssim},
                     {"val_psnr_conditioning", conditioning.psnr},
                     {"val_objects", count},
                     {"val_views", novel.views}});
    board_->scalars(step, {{"val/psnr_novel", novel.psnr}, {"val/ssim_novel", novel.ssim}});
    if (bar_) std::fputs("\r\033[K", stderr);
    folder_->log(
        format("step %llu: validation PSNR %.3f dB, SSIM %.4f on %u novel views of %u "
               "objects (input views %.3f dB)",
               static_cast<unsigned long long>(step), novel.psnr, novel.ssim, novel.views, count,
               conditioning.psnr));
    if (step > 0 && novel.psnr > best_psnr_) {
        best_psnr_ = novel.psnr;
        check(splat_weights_save(weights.get(), folder_->path("weights_best.safetensors").c_str(),
                                 0));
    }
}

void TrainingRun::write_run(const std::string& state) const {
    Json run = summary();
    run["state"] = state;
    run["library"] = splat_version_string();
    run["device"] = device_json(info_of(device_.get()));
    run["seed"] = config_.at("general").at("random_seed");
    const Json report = library_json(splat_trainer_report, trainer_.get());
    for (const char* key : {"parameters", "trainable"}) run[key] = report.at(key);
    Json data = data_->report();
    data.erase("names");
    data.erase("views_of");
    run["data"] = data;
    replace_file(folder_->path("run.json"), json_text(run) + "\n");
}

Json TrainingRun::summary() const {
    return {{"schema", 1},
            {"folder", folder_->path("").string()},
            {"step", step_},
            {"iterations", iterations_},
            {"skipped", skipped_},
            {"loss", loss_},
            {"val_psnr", last_psnr_},
            {"best_val_psnr", best_psnr_},
            {"peak_bytes", memory().peak_bytes}};
}

}  // namespace vkrun
