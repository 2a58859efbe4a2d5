// Times starts: one process after the other, up to the first result of a network.

#include "bench/model/start_bench.h"

#include <cstdio>

#include "core/os/process.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/temporary_folder.h"
#include "vkrun/cli/text.h"

namespace vkrun::bench {
namespace {

constexpr const char* kParts[] = {"device", "model", "read", "load", "pass", "all"};

std::string key_of(const char* part) {
    return std::string(part) + "_ms";
}

std::vector<std::string> command_of(const StartBenchOptions& options, const std::string& weights) {
    std::vector<std::string> command = {splat::os::program_file(),
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

void save_random(const StartBenchOptions& options, const std::string& path) {
    const Device device = open_device(device_desc(options.device));
    ModelRun(device.get(), options).save_weights(path);
}

PassTimes times_of(const Json& rounds, const std::string& key) {
    PassTimes times;
    for (const Json& round : rounds) times.times_ms.push_back(round.at(key).get<double>());
    return times;
}

}  // namespace

void answer_once(const StartBenchOptions& options) {
    const Stopwatch watch;
    const Device device = open_device(device_desc(options.device));
    Json json;
    json["device_ms"] = watch.ms();
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
}

Json measure_starts(const StartBenchOptions& options) {
    const TemporaryFolder folder;
    std::string weights = options.weights;
    if (weights.empty()) save_random(options, weights = folder.file("weights.safetensors"));
    Json json;
    json["library"] = splat_version_string();
    json["device"] = json["config"] = nullptr;
    json["low_memory"] = options.low_memory;
    for (int round = 0; round <= options.rounds; ++round) {
        const Stopwatch watch;
        const ModelPeer child(command_of(options, weights), "its message says why");
        const double all = watch.ms();
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

void print_starts(const Json& json, const StartBenchOptions& options) {
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
}

}  // namespace vkrun::bench
