// What a session begins with: configuration, data, weights to start from or a state, first batches.

#include <algorithm>
#include <utility>

#include "config/config_file.h"
#include "config/effects.h"
#include "core/finite.h"
#include "core/os/path.h"
#include "io/file.h"
#include "predict/published.h"
#include "predict/weights_place.h"
#include "train/splatter_training.h"

namespace splat::train {
namespace {

/// Batches that are read before the first step.
constexpr std::uint64_t kCheckedBatches = 2;

/// Values that ranks may have of their own: where the data and the weights lie, which are compared, and threads.
constexpr std::string_view kPlaces[] = {"data.root", "opt.pretrained_ckpt", "opt.num_workers"};

/// What is wrong with data or weights that others made, not with the caller's arguments.
Status of_file(const Status& status, const std::string& what = "") {
    if (status.ok()) return status;
    const Code code = status.code() == Code::kInvalidArgument ? Code::kFormat : status.code();
    return {code, what + status.message()};
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
    const fs::path folder = os::path_of(path);
    if (!fs::is_directory(folder, ignored)) return path;
    for (const char* name : {"model_latest.pth", "weights_last.safetensors"})
        if (fs::exists(folder / name, ignored)) return os::text_of(folder / name);
    return not_found(
        "'opt.pretrained_ckpt' is the folder '%s', which holds neither model_latest.pth "
        "nor weights_last.safetensors; name a file of weights",
        path.c_str());
}

/// Tells of objects that are not looked at. Errors: those of Dataset::read_cameras.
Status read_cameras(data::Dataset& dataset, run::Messages& messages) {
    const auto objects = static_cast<std::uint32_t>(dataset.index().names.size());
    const std::uint32_t stride = data::check_stride(objects);
    if (stride > 1)
        messages.push_back({format(
            "cameras of each %u-th of %u objects are checked before the first step, and of others "
            "as they are read; 'vkrun data check' looks at all of them",
            stride, objects)});
    return dataset.read_cameras();
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
            return damaged(
                "data: %s of the first batches hold %g, expected finite "
                "numbers; 'vkrun data check' looks at all of them",
                name, static_cast<double>((*values)[bad]));
    return {};
}

}  // namespace

Result<run::Plan> SplatterTraining::prepare(const run::ReadText* config, run::Messages& messages) {
    SPLAT_TRY(configure(config, messages));
    SPLAT_TRY(open_data(messages));
    SPLAT_TRY(warn_of_cameras(messages));
    if (!desc_.init.empty()) {
        std::error_code failed;
        const auto whole = std::filesystem::absolute(os::path_of(desc_.init), failed);
        start_ = {failed ? desc_.init : os::text_of(whole), desc_.init_options};
    }
    if (config == nullptr) SPLAT_TRY(read_start(messages));
    const config::TrainConfig& c = settings_.training;
    const std::size_t last = c.stages.empty() ? 0 : c.stages.size() - 1;
    auto made = context_->mutex.call([&]() -> Result<std::unique_ptr<Trainer>> {
        SPLAT_TRY(context_->device().alive());
        return Trainer::create(*context_, settings_.network, c.in_stage(last), group());
    });
    if (!made.ok() && !c.stages.empty()) return in_stage(last, made.status());
    SPLAT_ASSIGN(trainer_, std::move(made));
    stage_ = last;
    SPLAT_TRY(try_stages());
    run::Plan plan;
    plan.config = config::merged_config_text(settings_);
    plan.iterations = c.iterations;
    plan.log_every = c.log_every;
    plan.validate_every = c.validate_every;
    plan.save_every = c.checkpoint_every;
    plan.pieces = validated_objects();
    plan.protocol = {{"val_objects", static_cast<double>(plan.pieces)},
                     {"val_views_asked", static_cast<double>(c.validation_views)}};
    plan.protocol_text = "numbers of objects or views";
    plan.score = "validation PSNR";
    plan.results = {"weights"};
    plan.if_interrupted = "--resume continues it";
    plan.if_not_finite = "lower opt.base_lr, or look at the data ('vkrun data check')";
    plan.if_not_drawn =
        "look at data.znear, data.zfar and the poses of the data, or raise model.opacity_bias and "
        "model.scale_bias";
    return plan;
}

Status SplatterTraining::configure(const run::ReadText* config, run::Messages& messages) {
    if (config != nullptr && !desc_.init.empty())
        return invalid(
            "'%s' is given to start from, but a run that is resumed starts from its own "
            "state",
            desc_.init.c_str());
    Config given("configuration");
    std::optional<Config> run;
    if (config != nullptr) {
        SPLAT_ASSIGN(const Config own, read_config(config->text, config->path));
        SPLAT_ASSIGN(run, complete(own));
        given = *run;
    }
    if (desc_.config) SPLAT_SET(given, read_config(*desc_.config, "configuration"));
    SPLAT_ASSIGN(given, config::with_values(given, desc_.changes));
    SPLAT_ASSIGN(const auto warnings, config::training_warnings(given));
    for (const std::string& warning : warnings) messages.push_back({"warning: " + warning, true});
    SPLAT_ASSIGN(settings_, config::settings_of(given));
    if (!run) return {};
    SPLAT_ASSIGN(const Config whole, complete(given));
    for (const std::string& key : config::changed_keys(*run, whole)) {
        const std::string before = config::value_text(*run, key);
        const std::string after = config::value_text(whole, key);
        if (!config::may_change_on_resume(key))
            return invalid(
                "'%s' is %s, but %s in the run that is resumed, whose numbers depend on "
                "it; give the run's value, or begin a new run",
                key.c_str(), after.c_str(), before.c_str());
        const bool jumps =
            key == "opt.iterations" && settings_.training.schedule == config::Schedule::kCosine;
        const std::string change = key + " " + before + " -> " + after;
        messages.push_back(
            {jumps ? "warning: " + change +
                         ": with opt.lr_schedule cosine the learning rate of every step depends on "
                         "it, so the rate jumps where the run goes on"
                   : change,
             jumps});
    }
    return {};
}

Status SplatterTraining::open_data(run::Messages& messages) {
    using predict::ViewSource;
    if (desc_.dataset == nullptr && settings_.training.root.empty())
        return invalid("no data: 'data.root' is empty, expected the folder of the data set");
    auto opened = desc_.dataset != nullptr ? ViewSource::open(settings_, desc_.dataset)
                                           : ViewSource::open(settings_, "", "train");
    SPLAT_TRY(desc_.dataset != nullptr ? opened.status() : of_file(opened.status()));
    data_ = std::move(opened.value());
    SPLAT_TRY(of_file(read_cameras(data_->dataset(), messages)));
    SPLAT_TRY(BatchSource(data_, settings_, settings_.training.seed).check());
    const config::Settings seen = predict::without_map_losses(settings_);
    std::shared_ptr<data::Dataset> validation = desc_.validation;
    if (validation == nullptr && desc_.dataset == nullptr) {
        bool lacks_split = false;
        auto found = ViewSource::open_split(seen, "", "val", &lacks_split);
        if (found.ok())
            validation = std::move(found.value());
        else if (lacks_split)
            messages.push_back({"no validation: " + found.status().message()});
        else
            return of_file(found.status(), "split val: ");
    }
    if (validation != nullptr) {
        auto source = ViewSource::open(seen, std::move(validation));
        SPLAT_TRY(desc_.validation != nullptr ? source.status()
                                              : of_file(source.status(), "split val: "));
        validation_ = std::move(source.value());
        SPLAT_TRY(of_file(read_cameras(validation_->dataset(), messages), "split val: "));
    }
    return check_validation();
}

Status SplatterTraining::warn_of_cameras(run::Messages& messages) const {
    SPLAT_ASSIGN(const std::string sentence, data_->field_of_view_warning(data_->objects()));
    const auto depths = data_->depth_range_warning();  // points, which training does not need
    for (const std::string& found : {sentence, depths.ok() ? depths.value() : std::string()})
        if (!found.empty()) messages.push_back({"warning: " + found, true});
    return {};
}

Status SplatterTraining::check_validation() const {
    if (validation_ == nullptr) return {};
    const std::uint32_t inputs = settings_.network.views;
    for (std::uint32_t i = 0; i < validation_->objects(); ++i)
        if (validation_->views_of(i) <= inputs)
            return damaged("validation object '%s' has %u views, expected more than %u",
                           validation_->name(i).c_str(), validation_->views_of(i), inputs);
    return {};
}

Result<run::RankFacts> SplatterTraining::facts() {
    run::RankFacts facts;
    SPLAT_ASSIGN(const Config whole,
                 read_config(config::merged_config_text(settings_), "settings"));
    for (const config::Key& key : config::all_keys())
        if (std::ranges::find(kPlaces, std::string_view(key.name)) == std::end(kPlaces))
            facts.equal.emplace_back(format("'%s'", key.name), config::value_text(whole, key.name));
    add_facts(facts.equal, data_->dataset());
    const vk::DeviceInfo& device = context_->device().info();
    facts.device = format("%s (driver %s)", device.name.c_str(), device.driver.c_str());
    return facts;
}

Status SplatterTraining::read_start(run::Messages& messages) {
    const std::string& pretrained = settings_.training.pretrained;
    if (!start_.file.empty()) {
        if (!pretrained.empty())
            messages.push_back({"warning: opt.pretrained_ckpt '" + pretrained +
                                    "' is not read, because '" + start_.file +
                                    "' is given to start from",
                                true});
        return read_weights(start_.file, start_.options);
    }
    if (pretrained.empty()) return {};
    SPLAT_ASSIGN(const std::string path, pretrained_file(pretrained));
    return of_file(read_weights(path, {}), "opt.pretrained_ckpt: ");
}

Status SplatterTraining::read_weights(const std::string& path,
                                      const std::optional<model::LoadOptions>& options) {
    auto file = io::load_weights(path);
    SPLAT_TRY(of_file(file.status()));
    const io::NamedTensors& tensors = file.value().tensors;
    SPLAT_TRY(of_file(predict::expect_network(tensors, settings_.network), path + ": "));
    const model::LoadOptions likely{model::likely_channels(settings_.network, tensors), true};
    SPLAT_TRY(of_file(context_->mutex.call([&] {
        return model::check_state(*context_, settings_.network, tensors, options.value_or(likely));
    }),
                      path + ": "));
    first_weights_ = {path, options.value_or(likely), std::move(file.value().tensors)};
    return {};
}

Status SplatterTraining::start(run::Messages& messages) {
    SPLAT_TRY(
        context_->mutex.call([&] { return trainer_->model().init(settings_.training.seed); }));
    // A run that is resumed without a state begins again.
    if (first_weights_.path.empty()) SPLAT_TRY(read_start(messages));
    const auto [path, options, tensors] = std::exchange(first_weights_, {});
    if (path.empty()) return {};
    model::LoadReport report;
    {
        const std::lock_guard lock(context_->mutex);
        SPLAT_TRY(
            of_file(model::load_state(trainer_->model(), tensors, options, report), path + ": "));
    }
    messages.push_back({format(
        "started from %s: %zu tensors copied, %zu widened, %zu new, %zu left out", path.c_str(),
        report.copied.size(), report.widened.size(), report.fresh.size(), report.left_out.size())});
    if (!report.rays_differ) return {};
    std::string sentence =
        "warning: the ray grid of '" + path + "' differs from the configuration's and is " +
        (report.rays_taken ? "taken over" : "left out, so that predictions change");
    const auto configured = static_cast<double>(settings_.network.fov_degrees);
    if (const auto found = predict::field_of_view(tensors); found && configured > 0)
        sentence +=
            format(": its field of view is %.4g degrees, data.fov %.4g", *found, configured);
    messages.push_back({sentence, true});
    return {};
}

Status SplatterTraining::recall(const JsonTree& run_json, const std::string& path) {
    SPLAT_ASSIGN(start_, start_of(run_json, path));
    return {};
}

Status SplatterTraining::compare(const JsonTree& run_json, run::Messages& messages) {
    SPLAT_ASSIGN(const bool compared, check_same_data(run_json, data_->dataset()));
    if (!compared)
        messages.push_back(
            {"warning: the run does not say of which objects its data was, so other data of the "
             "same size would not be noticed",
             true});
    return {};
}

Status SplatterTraining::load(const io::WeightsFile& state) {
    SPLAT_TRY(load_stages(state));
    SPLAT_TRY(context_->mutex.call([&] { return trainer_->resume(state); }));
    told_ = trainer_->attempts();
    peaks_.clear();
    trainer_->results().clear();
    return {};
}

Status SplatterTraining::check_batches(const BatchSource& source) const {
    const std::uint64_t left =
        settings_.training.iterations - std::min(trainer_->steps(), settings_.training.iterations);
    for (std::uint64_t i = 0; i < std::min(left, kCheckedBatches); ++i) {
        const auto batch = source.make(trainer_->attempts() + i);
        SPLAT_TRY(of_file(batch.status()));
        SPLAT_TRY(check_numbers(batch.value()));
    }
    return {};
}

Status SplatterTraining::begin() {
    return open_batches(true);
}

Status SplatterTraining::open_batches(bool check) {
    config::Settings stage{settings_.network, trainer_->config()};
    BatchSource source(data_, stage, stage.training.seed, trainer_->first_object(),
                       trainer_->objects());
    source.begin_at(first_batch_.number, first_batch_.object);
    if (check) SPLAT_TRY(check_batches(source));
    const bool cpu = context_->device().info().kind == vk::DeviceKind::kCpu;
    SPLAT_ASSIGN(batches_,
                 Prefetch::create(std::move(source), loader_threads(settings_.training, cpu)));
    return {};
}

std::uint32_t SplatterTraining::validated_objects() const {
    if (validation_ == nullptr) return 0;
    const std::uint32_t asked = settings_.training.validation_objects;
    return asked == 0 ? validation_->objects() : std::min(asked, validation_->objects());
}

std::string SplatterTraining::headline(const std::string& folder) const {
    const nn::Parameters& parameters = trainer_->model().parameters();
    return format("training %s: %llu of %llu parameters, %u objects, step %llu of %llu, on %s",
                  folder.c_str(), llu(trainable_of(parameters)), llu(parameters.elements()),
                  data_->objects(), llu(trainer_->steps()), llu(settings_.training.iterations),
                  context_->device().info().name.c_str());
}

void SplatterTraining::describe(JsonWriter& json) const {
    add_facts(json, context_->device(), settings_.training.seed, trainer_->model().parameters(),
              data_->dataset(), start_);
    if (group() == nullptr) return;
    json.newline(2).member("ranks", group()->count());
    json.newline(2).member("reproducible", group()->reproducible());
}

}  // namespace splat::train
