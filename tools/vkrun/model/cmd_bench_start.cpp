// vkrun bench start: how long a program takes from its start to the first result of a network.

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "vkrun/command.h"
#include "vkrun/model/model_bench.h"
#include "vkrun/table.h"
#include "vkrun/temporary_folder.h"

namespace vkrun {
namespace {

constexpr const char* kBenchStartFooter =
    R"(Each round starts a process that opens the device, makes a model, reads its weights from a file,
runs it forward once and reads the means of the Gaussians. Wall times in ms:

  device    the driver is loaded, the device opened
  model     kernels are compiled or found in the driver's cache, memory is taken
  read      the file of weights; all but the first round find it in the page cache
  load      checks, and the way to the device
  pass      the first pass forward
  all       from the start of the process until its parent has the answer
  first ms  of the first process, which fills the caches unless they are warm already

JSON: {library, device, config, low_memory, rounds: [{device_ms, model_ms, read_ms, load_ms, pass_ms,
all_ms}], first, min, median}.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device.

Examples:
  vkrun bench start
  vkrun bench start --weights model.safetensors --low-memory --rounds 10 --json
)";

constexpr const char* kParts[] = {"device", "model", "read", "load", "pass", "all"};

struct BenchStartOptions : ModelBenchOptions {
    std::string file;
    std::string device = "best";
    bool once = false;
    bool json = false;
};

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
    return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

std::string key_of(const char* part) {
    return std::string(part) + "_ms";
}

/// The process of one round: prints what ModelPeer waits for.
int run_once(const BenchStartOptions& options) {
    const Clock::time_point start = Clock::now();
    const Device device = open_device(device_desc(options.device));
    Json json;
    json["device_ms"] = milliseconds_since(start);
    ModelRun run(device.get(), options);
    json["model_ms"] = run.create_ms();
    json["read_ms"] = run.read_ms();
    json["load_ms"] = run.init_ms();
    json["pass_ms"] = run.forward();
    static_cast<void>(run.output("means"));
    json["device"] = device_json(info_of(device.get()));
    json["config"] = run.report().at("config");
    std::printf("ready %s\n", json.dump().c_str());
    std::fflush(stdout);
    return kSuccess;
}

std::vector<std::string> command_of(const BenchStartOptions& options, const std::string& weights) {
    std::error_code ignored;
    std::vector<std::string> command = {
        std::filesystem::read_symlink("/proc/self/exe", ignored).string(),
        "bench",
        "start",
        "--once",
        "--device",
        options.device,
        "--weights",
        weights};
    if (!options.file.empty()) command.insert(command.end(), {"--config", options.file});
    if (options.low_memory) command.emplace_back("--low-memory");
    return command;
}

void save_random(const BenchStartOptions& options, const std::string& path) {
    const Device device = open_device(device_desc(options.device));
    ModelRun(device.get(), options).save_weights(path);
}

PassTimes times_of(const Json& rounds, const std::string& key) {
    PassTimes times;
    for (const Json& round : rounds) times.times_ms.push_back(round.at(key).get<double>());
    return times;
}

Json measure_starts(const BenchStartOptions& options) {
    const TemporaryFolder folder;
    std::string weights = options.weights;
    if (weights.empty()) save_random(options, weights = folder.file("weights.safetensors"));
    Json json;
    json["library"] = splat_version_string();
    json["device"] = json["config"] = nullptr;
    json["low_memory"] = options.low_memory;
    for (int round = 0; round <= options.rounds; ++round) {
        const Clock::time_point start = Clock::now();
        const ModelPeer child(command_of(options, weights), "its message says why");
        const double all = milliseconds_since(start);
        Json times = child.about();
        times["all_ms"] = all;
        for (const char* key : {"device", "config"}) {
            json[key] = times.at(key);
            times.erase(key);
        }
        if (round == 0)
            json["first"] = times;
        else
            json["rounds"].push_back(times);
    }
    for (const char* part : kParts) {
        const PassTimes times = times_of(json.at("rounds"), key_of(part));
        json["min"][key_of(part)] = times.min_ms();
        json["median"][key_of(part)] = times.median_ms();
    }
    return json;
}

int run_bench_start(BenchStartOptions options) {
    if (!options.file.empty()) options.config = read_text(options.file);
    if (options.once) return run_once(options);
    const Json json = measure_starts(options);
    if (options.json) {
        std::printf("%s\n", json_text(json).c_str());
        return kSuccess;
    }
    std::printf("%s; libsplat %s; %d processes after the first%s\n",
                json.at("device").at("name").get<std::string>().c_str(), splat_version_string(),
                options.rounds, options.low_memory ? "; low memory" : "");
    Table table({"  part", ">first ms", ">min ms", ">median ms"});
    for (const char* part : kParts) {
        const auto text = [&](const char* of) {
            return format("%.1f", json.at(of).at(key_of(part)).get<double>());
        };
        table.add({std::string("  ") + part, text("first"), text("min"), text("median")});
    }
    std::printf("%s", table.text().c_str());
    return kSuccess;
}

}  // namespace

void add_bench_start(CLI::App& bench, int& exit_code) {
    CLI::App* start = bench.add_subcommand(
        "start", "Time processes from their start to the first result of a network.");
    start->group("Commands");
    const auto options = std::make_shared<BenchStartOptions>();
    options->rounds = 6;
    start->add_option("--config", options->file, "JSON or YAML; else the cars model")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    start->add_option("--weights", options->weights, "Of that network; else random ones, in TMPDIR")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    start->add_flag("--low-memory", options->low_memory, "SPLAT_MODEL_LOW_MEMORY");
    start->add_option("--rounds", options->rounds, "Processes after the first; 6")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    start->add_flag("--once", options->once, "")->group("");  // the process of a round
    add_device_option(*start, options->device);
    start->add_flag("--json", options->json, "JSON on standard output");
    start->footer(kBenchStartFooter);
    start->callback([options, &exit_code] { exit_code = run_bench_start(*options); });
}

}  // namespace vkrun
