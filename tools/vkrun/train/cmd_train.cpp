// vkrun train: train a network on the images of a data set.

#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <ctime>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/config/merged_config.h"
#include "vkrun/train/training_run.h"

namespace vkrun {
namespace {

constexpr const char* kTrainFooter =
    R"(CONFIG is YAML or JSON with the keys of Splatter Image; without it, the published cars model is
trained. 'vkrun config list' explains every key, and 'vkrun config show' prints every value.

OUT holds config.json, run.json, log.txt, metrics.jsonl, events for TensorBoard, the last two states
(checkpoints/), weights_last and weights_best.safetensors (averaged weights), renders/ and, at the end,
report.html. Ctrl-C stops after the current step and saves everything. --resume continues from the last
state; the resumed run has the same bits as an uninterrupted one. peak_bytes in metrics.jsonl and run.json
is the most device memory used so far, by training and validation.

Exit status: 0 trained to the end, 1 failed, 2 wrong usage or configuration, 3 no device, 4 bad data,
5 out of memory, 7 ten steps in a row had a loss or gradients that are not finite, 130 interrupted.

Examples:
  vkrun data synth cars && vkrun train --data cars --out run --set opt.iterations=2000
  vkrun train cars.yaml --out run --resume
  vkrun train priors.yaml --init model_best.pth --set data.use_pred_depth=true --out run2
)";

volatile std::sig_atomic_t g_interrupted = 0;

void on_signal(int signal) {
    if (g_interrupted != 0) {  // a second signal ends at once
        std::signal(signal, SIG_DFL);
        std::raise(signal);
    }
    g_interrupted = 1;
}

std::string dated_folder() {
    const std::time_t now = std::time(nullptr);
    char text[32];
    std::strftime(text, sizeof text, "runs/%Y-%m-%d_%H-%M-%S", std::localtime(&now));
    return text;
}

struct TrainOptions {
    TrainingOptions training;
    bool show = false;
    bool json = false;
};

int train(TrainOptions& options) {
    if (options.show) {
        const Json config = merged_config(options.training.config, options.training.changes);
        std::printf("%s\n", config.dump(2).c_str());
        return kSuccess;
    }
    if (options.training.out.empty()) {
        if (options.training.resume)
            throw Failure(kUsageError, "--resume needs --out, the folder of the run");
        options.training.out = dated_folder();
    }
    std::signal(SIGINT, on_signal);
    std::signal(SIGTERM, on_signal);
    TrainingRun training(options.training);
    const TrainingEnd end = training.run([] { return g_interrupted != 0; });
    if (options.json) print_json(training.summary());
    switch (end) {
        case TrainingEnd::kDone:
            return kSuccess;
        case TrainingEnd::kInterrupted:
            return kInterrupted;
        case TrainingEnd::kNotFinite:
            return kNotFinite;
    }
    return kFailed;
}

}  // namespace

void add_train(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "train", "Train a network on a data set.", kTrainFooter);
    auto options = std::make_shared<TrainOptions>();
    TrainingOptions& t = options->training;
    command
        ->add_option("CONFIG", t.config,
                     "Configuration, YAML or JSON; default: the published cars model")
        ->type_name("");
    command->add_option("--data", t.data, "Folder of the data set; replaces data.root")
        ->type_name("DIR");
    command->add_option("--out", t.out, "Folder of the run; default: runs/DATE")->type_name("DIR");
    add_changes_option(*command, t.changes);
    command->add_flag("--resume", t.resume, "Continue the run in --out");
    command->add_flag("--overwrite", t.overwrite, "Replace the run in --out");
    command->add_option("--init", t.init, "Weights to start from, grafted where channels differ")
        ->type_name("FILE");
    command
        ->add_option("--init-channels", t.init_channels,
                     "Input channels of --init after RGB: any of depth,normal,mask")
        ->type_name("LIST")
        ->delimiter(',');
    command->add_flag("--show", options->show, "Print the merged configuration and exit");
    add_device_option(*command, t.device);
    command->add_flag("--json", options->json,
                      "Print one JSON object on standard output at the end");
    command->callback([options, &exit_code] { exit_code = train(*options); });
}

}  // namespace vkrun
