// Training::open: configuration, data, weights to start from or the latest state, folder.

#include <algorithm>

#include "config/config_file.h"
#include "config/effects.h"
#include "core/finite.h"
#include "io/file.h"
#include "predict/weights_place.h"
#include "train/training.h"

namespace splat::train {
namespace {

/// Batches that are read before the first step.
constexpr std::uint64_t kCheckedBatches = 2;

/// Batches that are made ahead of a step.
constexpr std::size_t kBatchesAhead = 2;

/// What is wrong with data or weights that others made, not with the caller's arguments.
Status of_file(const Status& status, const std::string& what = "") {
    if (status.ok()) return status;
    const Code code = status.code() == Code::kInvalidArgument ? Code::kFormat : status.code();
    return {code, what + status.message()};
}

/// Success, or an error that another state may not have.
bool may_be_skipped(Code code) {
    return code != Code::kCancelled && code != Code::kOutOfHostMemory &&
           code != Code::kOutOfDeviceMemory && code != Code::kDeviceLost;
}

/// Every value of a configuration.
Result<Config> complete(const Config& config) {
    SPLAT_ASSIGN(const config::Settings settings, config::settings_of(config));
    return read_config(config::merged_config_text(settings), config.what());
}

/// The file in opt.pretrained_ckpt: the value itself, or what a run's folder holds.
Result<std::string> pretrained_file(const std::string& path) {
    namespace fs = std::filesystem;
    std::error_code ignored;
    if (!fs::is_directory(path, ignored)) return path;
    for (const char* name : {"model_latest.pth", "weights_last.safetensors"})
        if (fs::exists(fs::path(path) / name, ignored)) return (fs::path(path) / name).string();
    return error(Code::kNotFound,
                 "'opt.pretrained_ckpt' is the folder '%s', which holds neither model_latest.pth "
                 "nor weights_last.safetensors; name a file of weights",
                 path.c_str());
}

/// Errors: kFormat, naming the array.
Status check_numbers(const Batch& batch) {
    const std::pair<const char*, const std::vector<float>*> arrays[] = {
        {"poses", &batch.view_to_world},
        {"quaternions", &batch.quaternions},
        {"focal lengths", &batch.focals},
        {"embeddings", &batch.embedding},
        {"tokens", &batch.tokens}};
    for (const auto& [name, values] : arrays)
        if (const std::size_t bad = find_not_finite(*values); bad < values->size())
            return error(Code::kFormat,
                         "data: %s of the first batches hold %g, expected finite "
                         "numbers; 'vkrun data check' looks at all of them",
                         name, static_cast<double>((*values)[bad]));
    return {};
}

}  // namespace

Result<std::unique_ptr<Training>> Training::open(std::shared_ptr<vk::Context> context,
                                                 const TrainingDesc& desc,
                                                 const Interrupt& interrupt) {
    const vk::DeviceCall call(context->mutex);
    std::unique_ptr<Training> self(new Training(std::move(context), interrupt));
    self->library_ = desc.library;
    SPLAT_ASSIGN(self->folder_, RunFolder::open(desc.folder, desc.mode));
    SPLAT_TRY(self->configure(desc));
    SPLAT_TRY(self->open_data(desc));
    SPLAT_TRY(self->warn_of_cameras());
    const Status made = self->on_device([&]() -> Status {
        SPLAT_TRY(self->context_->device().alive());
        SPLAT_ASSIGN(self->trainer_, Trainer::create(*self->context_, self->settings_.network,
                                                     self->settings_.training));
        return {};
    });
    SPLAT_TRY(made);
    if (!desc.init.empty()) {
        std::error_code failed;
        const auto whole = std::filesystem::absolute(desc.init, failed);
        self->start_ = {failed ? desc.init : whole.string(), desc.init_options};
    }
    if (desc.mode == RunFolder::Mode::kResume)
        SPLAT_TRY(self->resume());
    else
        SPLAT_TRY(self->start());
    BatchSource source(self->data_, self->settings_, self->settings_.training.seed);
    SPLAT_TRY(self->check_batches(source));
    SPLAT_ASSIGN(self->batches_, Prefetch::create(std::move(source), kBatchesAhead));
    SPLAT_TRY(self->begin(desc));
    return self;
}

Status Training::configure(const TrainingDesc& desc) {
    if (desc.mode == RunFolder::Mode::kResume && !desc.init.empty())
        return error(Code::kInvalidArgument,
                     "'%s' is given to start from, but a run that is resumed starts from its own "
                     "state",
                     desc.init.c_str());
    Config given("configuration");
    std::optional<Config> run;
    if (desc.mode == RunFolder::Mode::kResume) {
        const std::string path = folder_->path("config.json");
        SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(path, kMaxConfigBytes));
        SPLAT_ASSIGN(const Config own, read_config(io::as_text(bytes), path));
        SPLAT_ASSIGN(run, complete(own));
        given = *run;
    }
    if (desc.config) {
        SPLAT_ASSIGN(given, read_config(*desc.config, "configuration"));
    }
    SPLAT_ASSIGN(given, config::with_values(given, desc.changes));
    SPLAT_ASSIGN(const auto warnings, config::training_warnings(given));
    for (const std::string& warning : warnings) messages_.emplace_back("warning: " + warning, true);
    SPLAT_ASSIGN(settings_, config::settings_of(given));
    config_ = config::merged_config_text(settings_);
    if (!run) return {};
    SPLAT_ASSIGN(const Config whole, read_config(config_, "configuration"));
    for (const std::string& key : config::changed_keys(*run, whole)) {
        const std::string before = config::value_text(*run, key);
        const std::string after = config::value_text(whole, key);
        if (!config::may_change_on_resume(key))
            return error(Code::kInvalidArgument,
                         "'%s' is %s, but %s in the run that is resumed, whose numbers depend on "
                         "it; give the run's value, or begin a new run",
                         key.c_str(), after.c_str(), before.c_str());
        const bool jumps =
            key == "opt.iterations" && settings_.training.schedule == config::Schedule::kCosine;
        const std::string change = key + " " + before + " -> " + after;
        messages_.emplace_back(
            jumps ? "warning: " + change +
                        ": with opt.lr_schedule cosine the learning rate of every step depends on "
                        "it, so the rate jumps where the run goes on"
                  : change,
            jumps);
    }
    return {};
}

Status Training::open_data(const TrainingDesc& desc) {
    using predict::ViewSource;
    if (desc.dataset == nullptr && settings_.training.root.empty())
        return error(Code::kInvalidArgument,
                     "no data: 'data.root' is empty, expected the folder of the data set");
    auto opened = desc.dataset != nullptr ? ViewSource::open(settings_, desc.dataset)
                                          : ViewSource::open(settings_, "", "train");
    SPLAT_TRY(desc.dataset != nullptr ? opened.status() : of_file(opened.status()));
    data_ = std::move(opened.value());
    SPLAT_TRY(of_file(data_->dataset().read_cameras()));
    SPLAT_TRY(BatchSource(data_, settings_, settings_.training.seed).check());
    std::shared_ptr<data::Dataset> validation = desc.validation;
    if (validation == nullptr && desc.dataset == nullptr) {
        bool lacks_split = false;
        auto found = ViewSource::open_split(settings_, "", "val", &lacks_split);
        if (found.ok())
            validation = std::move(found.value());
        else if (lacks_split)
            messages_.emplace_back("no validation: " + found.status().message(), false);
        else
            return of_file(found.status(), "split val: ");
    }
    if (validation != nullptr) {
        auto source = ViewSource::open(settings_, std::move(validation));
        SPLAT_TRY(desc.validation != nullptr ? source.status()
                                             : of_file(source.status(), "split val: "));
        validation_ = std::move(source.value());
        SPLAT_TRY(of_file(validation_->dataset().read_cameras(), "split val: "));
    }
    return check_validation();
}

Status Training::warn_of_cameras() {
    SPLAT_ASSIGN(const std::string sentence, data_->field_of_view_warning(data_->objects()));
    const auto depths = data_->depth_range_warning();  // points, which training does not need
    for (const std::string& found : {sentence, depths.ok() ? depths.value() : std::string()})
        if (!found.empty()) messages_.emplace_back("warning: " + found, true);
    return {};
}

Status Training::check_validation() {
    if (validation_ == nullptr) return {};
    const std::uint32_t inputs = settings_.network.views;
    for (std::uint32_t i = 0; i < validation_->objects(); ++i)
        if (validation_->views_of(i) <= inputs)
            return error(Code::kFormat,
                         "validation object '%s' has %u views, expected more than %u",
                         validation_->name(i).c_str(), validation_->views_of(i), inputs);
    return {};
}

Status Training::start() {
    SPLAT_TRY(on_device([&] { return trainer_->model().init(settings_.training.seed); }));
    const std::string& pretrained = settings_.training.pretrained;
    if (!start_.file.empty()) {
        if (!pretrained.empty())
            messages_.emplace_back("warning: opt.pretrained_ckpt '" + pretrained +
                                       "' is not read, because '" + start_.file +
                                       "' is given to start from",
                                   true);
        return load_weights(start_.file, start_.options);
    }
    if (pretrained.empty()) return {};
    SPLAT_ASSIGN(const std::string path, pretrained_file(pretrained));
    return of_file(load_weights(path, {}), "opt.pretrained_ckpt: ");
}

Status Training::load_weights(const std::string& path,
                              const std::optional<model::LoadOptions>& options) {
    const auto file = io::load_weights(path);
    SPLAT_TRY(of_file(file.status()));
    const io::NamedTensors& tensors = file.value().tensors;
    const model::LoadOptions likely{model::likely_channels(settings_.network, tensors), true};
    model::LoadReport report;
    {
        const std::lock_guard lock(context_->mutex);
        SPLAT_TRY(
            of_file(model::load_state(trainer_->model(), tensors, options.value_or(likely), report),
                    path + ": "));
    }
    messages_.emplace_back(
        format("started from %s: %zu tensors copied, %zu widened, %zu new, %zu left out",
               path.c_str(), report.copied.size(), report.widened.size(), report.fresh.size(),
               report.left_out.size()),
        false);
    if (!report.rays_differ) return {};
    std::string sentence =
        "warning: the ray grid of '" + path + "' differs from the configuration's and is " +
        (report.rays_taken ? "taken over" : "left out, so that predictions change");
    const auto configured = static_cast<double>(settings_.network.fov_degrees);
    if (const auto found = predict::field_of_view(tensors); found && configured > 0)
        sentence +=
            format(": its field of view is %.4g degrees, data.fov %.4g", *found, configured);
    messages_.emplace_back(sentence, true);
    return {};
}

Status Training::resume() {
    const std::string record = folder_->path("run.json");
    const auto text = io::read_file(record, kMaxConfigBytes);
    auto start = text.ok() ? start_of(io::as_text(text.value()), record.c_str())
                           : Result<Start>(text.status());
    if (start.ok()) start_ = std::move(start.value());
    SPLAT_ASSIGN(const auto states, folder_->states());
    if (states.empty()) {
        if (!start.ok())
            return {start.status().code(),
                    start.status().message() +
                        "; without it a run that has no state yet cannot begin again: let it be "
                        "overwritten"};
        messages_.emplace_back("the run has no state yet, and begins again", false);
        return this->start();
    }
    bool compared = false;
    if (text.ok()) {
        SPLAT_ASSIGN(compared, check_same_data(io::as_text(text.value()), data_->dataset()));
    }
    if (!compared)
        messages_.emplace_back(
            "warning: the run does not say of which objects its data was, so other data of the "
            "same size would not be noticed",
            true);
    for (const auto& path : states) {
        const auto file = io::load_weights(path.string());
        Status resumed = file.status();
        if (file.ok()) resumed = on_device([&] { return trainer_->resume(file.value()); });
        if (!may_be_skipped(resumed.code())) return resumed;
        if (!resumed.ok()) {
            messages_.emplace_back("skipped a state: " + resumed.message(), true);
            unreadable_.push_back(path);
            continue;
        }
        step_ = saved_ = begun_at_ = trainer_->steps();
        skipped_ = trainer_->attempts() - step_;
        messages_.emplace_back("resumed from " + path.filename().string(), false);
        return restore_validations();
    }
    return error(Code::kNotFound,
                 "no state in '%s' can be read; to start again, let the run be overwritten",
                 folder_->path("checkpoints").c_str());
}

/// Take over the validations of the run, from the latest one on that saw other numbers of objects or views than
/// those to come.
Status Training::restore_validations() {
    const std::uint32_t objects = validation_ == nullptr ? 0 : validated_objects();
    const std::uint32_t views = settings_.training.validation_views;
    bool others = false;  // was the latest one another
    SPLAT_ASSIGN(const std::vector<MetricLine> lines, folder_->metrics());
    for (const MetricLine& line : lines) {
        if (!line.validation_psnr || line.step > step_) continue;
        others = validation_ != nullptr && (line.validation_objects.value_or(objects) != objects ||
                                            line.validation_views.value_or(views) != views);
        if (others) {
            best_psnr_ = 0;
            last_psnr_ = NAN;
            validated_ = ~std::uint64_t{0};
            continue;
        }
        last_psnr_ = *line.validation_psnr;
        if (line.step > 0) best_psnr_ = std::max(best_psnr_, last_psnr_);
        if (line.step == step_) validated_ = step_;
    }
    if (others)
        messages_.emplace_back(
            "warning: the validations so far saw other numbers of objects or views, so the best "
            "validation PSNR and weights_best.safetensors begin anew",
            true);
    return {};
}

Status Training::check_batches(const BatchSource& source) const {
    const std::uint64_t left =
        settings_.training.iterations - std::min(step_, settings_.training.iterations);
    for (std::uint64_t i = 0; i < std::min(left, kCheckedBatches); ++i) {
        const auto batch = source.make(trainer_->attempts() + i);
        SPLAT_TRY(of_file(batch.status()));
        SPLAT_TRY(check_numbers(batch.value()));
    }
    return {};
}

Status Training::begin(const TrainingDesc& desc) {
    SPLAT_ASSIGN(const std::size_t left, folder_->begin(config_));
    if (desc.mode == RunFolder::Mode::kResume) SPLAT_TRY(folder_->cut_metrics(step_));
    for (const auto& state : unreadable_) SPLAT_TRY(folder_->set_aside(state));
    if (left > 0)
        messages_.emplace_back(format("removed %zu unfinished files that a crash left", left),
                               false);
    std::uint64_t parameters = 0, trainable = 0;
    for (const nn::Parameter& parameter : trainer_->model().parameters().all()) {
        parameters += parameter.shape.elements();
        if (parameter.trainable) trainable += parameter.shape.elements();
    }
    messages_.emplace_back(
        format("training %s: %llu of %llu parameters, %u objects, step %llu of %llu, on %s",
               desc.folder.c_str(), static_cast<unsigned long long>(trainable),
               static_cast<unsigned long long>(parameters), data_->objects(),
               static_cast<unsigned long long>(step_),
               static_cast<unsigned long long>(settings_.training.iterations),
               context_->device().info().name.c_str()),
        false);
    for (const auto& [text, warning] : messages_) SPLAT_TRY(folder_->log(text));
    return write_run("running");
}

}  // namespace splat::train
