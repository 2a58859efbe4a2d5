// vkrun train: train a network on the images of a data set.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <iterator>
#include <memory>
#include <optional>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/data/open_data.h"
#include "vkrun/ranks/ranks.h"
#include "vkrun/train/run_signals.h"
#include "vkrun/train/training_view.h"
#include "vkrun/weights/builtin_weights.h"
#include "vkrun/weights/model_load.h"
#include "vkrun/weights/published.h"

namespace vkrun {
namespace {

constexpr const char* kTrainFooter =
    R"(CONFIG is YAML or JSON with the keys of Splatter Image, or the name of a configuration ('vkrun config
presets'): "small" ends within minutes on two cores; without CONFIG, the published cars model is trained, which
takes days on a GPU. 'vkrun config list' explains every key, and 'vkrun config show' prints every value. A run
that will take more than an hour says so as soon as its first steps tell.

OUT holds config.json, run.json, log.txt, metrics.jsonl, events for TensorBoard, the last two states
(checkpoints/), weights_last and weights_best.safetensors (averaged weights), renders/, lock, and report.html,
which is renewed at every validation, loads itself again, and turns a validation object. Ctrl-C, SIGTERM, a closed
terminal (SIGHUP) and a closed pipe (SIGPIPE) stop after the current step, or the current object of a validation, and
save everything; a third signal ends at once. --resume continues
from the last state, or begins again where none was saved; the resumed run has the same bits as an uninterrupted
one. With CONFIG or --set, values that no earlier step depends on may change, and opt.iterations, with a warning
where opt.lr_schedule is cosine; anything else, such as other data in data.root, is an error. --overwrite replaces
what a run wrote and leaves other files in OUT. peak_bytes in metrics.jsonl and run.json is the most device memory
used so far, by training and validation.

Under mpirun or srun, processes train one network, each on a device and with a part of opt.batch_size
(docs/ranks.md); the first one has OUT. A signal for any of them saves and ends all.

Exit status: 0 trained to the end, 1 failed, such as a full disk, 2 wrong usage or configuration, or OUT is in use,
3 no device, 4 bad data, 5 out of memory, 7 ten steps in a row had a loss or gradients that are not finite, or
200 drew nothing, 130 interrupted.

Examples:
  vkrun data synth cars --objects 64 --val 4 --size 64
  vkrun train small --data cars --out run
  vkrun train --out run --resume
  vkrun train hydrants --data co3d --out run
  vkrun train tools/weights/cars64/cars64.yaml --init cars64 --data mine --out run
  mpirun -n 4 vkrun train cars --data srn_cars --out run
  vkrun train cars_priors_depth --init model_cars.pth --data mine --out run2
)";

std::string dated_folder() {
    const std::time_t now = std::time(nullptr);
    char text[32];
    std::strftime(text, sizeof text, "runs/%Y-%m-%d_%H-%M-%S", std::localtime(&now));
    return text;
}

struct TrainOptions {
    std::string config, data, out, init;
    std::vector<std::string> changes, init_channels;
    bool resume = false;
    bool overwrite = false;
    std::string device = "best";
    RankOptions ranks;
    bool allow_missing = false;
    bool show = false;
    bool profile = false;
    bool json = false;
};

/// Counts in the profile of a device what the steps of a training take, without validations and states.
class StepCounts {
  public:
    explicit StepCounts(splat_device device) : device_(device) { read(before_); }

    /// Take what was done since the call before as that of an event.
    void add(splat_run_event_kind kind) {
        double now[std::size(kCounts)];
        read(now);
        steps_ += kind == SPLAT_EVENT_STEP ? 1 : 0;
        for (std::size_t i = 0; i < std::size(kCounts); ++i) {
            if (kind == SPLAT_EVENT_STEP) sums_[i] += now[i] - before_[i];
            before_[i] = now[i];
        }
    }
    /// Means over the steps.
    [[nodiscard]] Json json() const {
        Json json{{"steps", steps_}};
        for (std::size_t i = 0; i < std::size(kCounts); ++i)
            json[kCounts[i].name] = sums_[i] / static_cast<double>(std::max(steps_, 1));
        return json;
    }
    void print() const {
        std::printf("%d steps, each with", steps_);
        for (std::size_t i = 0; i < std::size(kCounts); ++i)
            std::printf("%s %.1f %s", i == 0 ? "" : ",",
                        sums_[i] / static_cast<double>(std::max(steps_, 1)), kCounts[i].text);
        std::printf("; the whole session:\n%s",
                    library_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
                        return splat_device_profile_table(device_, buffer, capacity, needed);
                    }).c_str());
    }

  private:
    static constexpr struct {
        const char *part, *member, *name, *text;
    } kCounts[] = {{"lists", "count", "lists", "lists"},
                   {"lists", "submits", "submits", "submits"},
                   {"transfers", "reads", "reads", "reads"},
                   {"transfers", "read_bytes", "read_bytes", "bytes read"},
                   {"transfers", "writes", "writes", "writes"},
                   {"transfers", "written_bytes", "written_bytes", "bytes written"}};

    void read(double (&counts)[std::size(kCounts)]) const {
        const Json profile = library_json(splat_device_profile_json, device_);
        for (std::size_t i = 0; i < std::size(kCounts); ++i)
            counts[i] = profile.at(kCounts[i].part).at(kCounts[i].member).get<double>();
    }

    splat_device device_;
    double before_[std::size(kCounts)] = {}, sums_[std::size(kCounts)] = {};
    int steps_ = 0;
};

/// The configuration as the file and --set give it; of a resumed run the library has the rest. Rank 0 imports tables.
void check_config(const TrainOptions& options, const Ranks& ranks) {
    if (options.resume && options.config.empty()) return;
    const Json config = merged_config(options.config, options.changes);
    const Json& data = config.at("data");
    const std::string root =
        options.data.empty() ? data.at("root").get<std::string>() : options.data;
    if (!options.resume && root.empty())
        throw Failure(kUsageError, "no data: name its folder with --data, or as data.root");
    if (root.empty()) return;
    for (const char* split : {"train", "val"})
        if (ranks.leads()) import_first(root, data.at("format").get<std::string>(), split);
}

/// --set, --allow-missing, and --data as data.root.
std::vector<std::string> all_changes(const TrainOptions& options) {
    std::vector<std::string> changes = options.changes;
    if (options.allow_missing) changes.emplace_back("data.allow_missing=true");
    if (!options.data.empty()) changes.push_back("data.root=" + Json(options.data).dump());
    return changes;
}

Run open_training(splat_device device, const TrainOptions& options, const Ranks& ranks) {
    const std::vector<std::string> changes = all_changes(options);
    std::vector<const char*> values;
    for (const std::string& change : changes) values.push_back(change.c_str());
    const std::string config = options.config.empty() ? "" : config_text(options.config);
    auto desc = sized<splat_training_desc>();
    if (options.resume) desc.flags |= SPLAT_TRAINING_RESUME;
    if (options.overwrite) desc.flags |= SPLAT_TRAINING_OVERWRITE;
    desc.folder = options.out.c_str();
    desc.group = ranks.group();
    if (!options.config.empty()) desc.config = config.c_str();
    desc.values = values.data();
    desc.value_count = values.size();
    std::string init;
    if (!options.init.empty()) {
        init = weights_named(options.init);
        warn_of_old_weights(init);
        desc.init = init.c_str();
        desc.init_flags = graft_flags("--init-channels", options.init_channels);
    }
    Run training;
    const splat_result opened = splat_training_open(device, &desc, training.out());
    const bool bad_data = opened == SPLAT_ERROR_NOT_FOUND || opened == SPLAT_ERROR_FORMAT ||
                          opened == SPLAT_ERROR_SHAPE_MISMATCH;
    check(opened, bad_data ? kBadData : opened == SPLAT_ERROR_IO ? kFailed : kUsageError);
    return training;
}

/// Returns the kind of the event that ended it. `counts`: none without --profile. `shows`: this is rank 0.
splat_run_event_kind run(splat_run training, const TrainOptions& options, bool shows,
                         std::optional<StepCounts>& counts) {
    std::optional<TrainingView> view;
    if (shows) view.emplace(options.out, options.device);
    auto event = sized<splat_run_event>();
    while (event.kind < SPLAT_EVENT_DONE) {
        if (run_interrupted()) check(splat_run_interrupt(training));
        const splat_result result = splat_run_next(training, &event);
        try {
            check(result, result == SPLAT_ERROR_IO ? kFailed : kBadData);
        } catch (const Failure&) {
            if (view) view->show_failure();
            throw;
        }
        if (view) view->show(event);
        if (counts) counts->add(event.kind);
        if (shows) prepare_farewell(event);
    }
    return event.kind;
}

int train_here(const TrainOptions& options, const Ranks& ranks) {
    check_config(options, ranks);
    ranks.wait("rank 0 to import tables, which 'vkrun data import' does before");
    catch_run_signals(ranks.leads());
    splat_device_desc desc = ranks.device_desc(options.device);
    if (options.profile) desc.flags = SPLAT_DEVICE_PROFILE;
    const Device device = open_device(desc);
    const Run training = open_training(device.get(), options, ranks);
    std::optional<StepCounts> counts;
    if (options.profile && ranks.leads()) counts.emplace(device.get());
    const splat_run_event_kind end = run(training.get(), options, ranks.leads(), counts);
    if (counts && !options.json) counts->print();
    if (options.json && ranks.leads()) {
        Json report = library_json(splat_run_report, training.get());
        if (counts) report["profile"] = counts->json();
        print_json(report);
    }
    switch (end) {
        case SPLAT_EVENT_DONE:
            return kSuccess;
        case SPLAT_EVENT_INTERRUPTED:
            return kInterrupted;
        default:
            return kNotFinite;
    }
}

int train(TrainOptions& options) {
    if (options.show) {
        const Json config = merged_config(options.config, all_changes(options));
        std::printf("%s\n", config.dump(2).c_str());
        return kSuccess;
    }
    if (options.resume && options.overwrite)
        throw Failure(kUsageError, "--resume and --overwrite exclude each other");
    if (options.init.empty() && !options.init_channels.empty())
        throw Failure(kUsageError, "--init-channels needs --init, the weights that have them");
    if (options.out.empty()) {
        if (options.resume)
            throw Failure(kUsageError, "--resume needs --out, the folder of the run");
        options.out = dated_folder();
    }
    const Ranks ranks(options.ranks);
    const int status = train_here(options, ranks);
    ranks.finish();
    return status;
}

}  // namespace

void add_train(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "train", "Train a network on a data set.", kTrainFooter);
    auto options = std::make_shared<TrainOptions>();
    TrainOptions& t = *options;
    command
        ->add_option("CONFIG", t.config,
                     "Configuration, YAML or JSON, or the name of one such as chairs;\n"
                     "default: the published cars model")
        ->type_name("");
    command->add_option("--data", t.data, "Folder of the data set; replaces data.root")
        ->type_name("DIR");
    command->add_option("--out", t.out, "Folder of the run; default: runs/DATE")->type_name("DIR");
    add_changes_option(*command, t.changes);
    add_allow_missing_flag(*command, t.allow_missing);
    command->add_flag("--resume", t.resume, "Continue the run in --out");
    command->add_flag("--overwrite", t.overwrite, "Replace the run in --out");
    command
        ->add_option("--init", t.init,
                     "Weights to start from, grafted where channels differ; a file, or the\n"
                     "name of built-in ones: cars64")
        ->type_name("FILE");
    command
        ->add_option("--init-channels", t.init_channels,
                     "Input channels of --init after RGB: any of depth,normal,mask,plane")
        ->type_name("LIST")
        ->delimiter(',');
    CLI::Option* show =
        command->add_flag("--show", t.show,
                          "Print the merged configuration and exit; excludes --out,\n"
                          "--resume, --overwrite, --init and --init-channels");
    for (const char* other : {"--out", "--resume", "--overwrite", "--init", "--init-channels"})
        show->excludes(other);
    add_device_option(*command, t.device);
    add_rank_options(*command, t.ranks);
    command->add_flag("--profile", t.profile,
                      "At the end, print lists, submits and bytes of a step, and times by\n"
                      "operator of the session; makes it slower");
    command->add_flag("--json", t.json, "Print one JSON object on standard output at the end");
    command->callback([options, &exit_code] { exit_code = train(*options); });
}

}  // namespace vkrun
