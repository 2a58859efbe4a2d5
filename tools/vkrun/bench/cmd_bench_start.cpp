// vkrun bench start: the time from the start of a program to the first result of a network.

#include <CLI/CLI.hpp>
#include <memory>

#include "bench/model/start_bench.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/config/merged_config.h"

namespace vkrun {
namespace {

constexpr const char* kBenchStartFooter =
    R"(Each round starts a process that opens the device, makes a model, reads its weights from a file,
runs it forward once and reads the means of the Gaussians. Wall times in ms:

  device    the driver is loaded, the device opened
  model     kernels are compiled or found in the driver's cache, memory is taken
  read      the file of weights; all but the first round find it in the page cache
  load      the weights are checked and copied to the device
  pass      the first forward pass
  all       from the start of the process until its parent has the answer
  first ms  of the first process, which fills the caches if they are cold

JSON: {library, device, config, low_memory, rounds: [{device_ms, model_ms, read_ms, load_ms, pass_ms,
all_ms}], first, min, median}.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device.

Examples:
  vkrun bench start
  vkrun bench start --weights model.safetensors --low-memory --rounds 10 --json
)";

struct BenchStartOptions : bench::StartBenchOptions {
    bool once = false;
    bool json = false;
};

int run_bench_start(BenchStartOptions options) {
    if (!options.file.empty()) options.config = config_text(options.file);
    if (options.once) {
        bench::answer_once(options);
        return kSuccess;
    }
    const Json json = bench::measure_starts(options);
    if (options.json)
        print_json(json);
    else
        bench::print_starts(json, options);
    return kSuccess;
}

}  // namespace

void add_bench_start(CLI::App& bench, int& exit_code) {
    CLI::App* start = add_command(
        bench, "start", "Time processes from their start to the first result of a network.",
        kBenchStartFooter);
    const auto options = std::make_shared<BenchStartOptions>();
    options->rounds = 6;
    start
        ->add_option("--config", options->file,
                     "Configuration, YAML or JSON; default: the cars model")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""));
    start
        ->add_option("--weights", options->weights,
                     "Weights of the network; default: random ones, in TMPDIR")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""));
    start->add_flag("--low-memory", options->low_memory, "Keep no prepared weights");
    start->add_option("--rounds", options->rounds, "Processes after the first")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000).description(""));
    start->add_flag("--once", options->once, "")->group("");  // the process of a round
    add_device_option(*start, options->device);
    add_json_flag(*start, options->json);
    start->callback([options, &exit_code] { exit_code = run_bench_start(*options); });
}

}  // namespace vkrun
