// vkrun bench model: how fast a whole network runs, alone or in turns with PyTorch.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <memory>
#include <sstream>

#include "vkrun/command.h"
#include "vkrun/model_bench.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

constexpr const char* kFooter =
    R"(A network with random weights runs forward and, with --backward, forward and backward with all
gradients of outputs 1; wall time of the calls, inputs and their checks included.

  first ms           the first call: kernels are compiled or found in the cache, weights prepared
  min ms, median ms  of --rounds further calls
  GFLOP/s            of the shortest: convolutions and products of attention, two operations per
                     multiplication as a direct convolution needs them; forward + backward counts
                     as three forward passes, and not at all with adapters
  peer               --peer: the same network in PyTorch, on the CPU with 2 threads, in a process
                     of tools/bench/torch_model.py; both take turns (A B A B)
  ratio              the peer's shortest time over ours: above 1, libsplat is faster
  memory             activations and prepared weights of the model; all that the device holds
  --profile          times of one more pass by operator; every pass then has timestamps

JSON: {library, device, config, precision, objects, parameters, trainable, gflop, create_ms, init_ms,
memory, forward, forward_backward, peer, ratio_forward, ratio_forward_backward, profile}; what was
not asked for is null.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device.

Examples:
  vkrun bench model --backward --peer
  vkrun bench model --config config.yaml --lora 8 --backward --precision fast --json
)";

struct Options : ModelBenchOptions {
    std::string file;
    std::string precision_name = "balanced";
    std::string device = "best";
    std::string peer_isa = "default";
    std::string peer_layout = "channels_last";
    std::string python = "/usr/bin/python3";  // where Debian's python3-torch is found
    std::string script;
    bool peer = false;
    bool json = false;
    bool profile = false;
};

std::string read_text(const std::string& path) {
    std::ifstream file(path);
    std::ostringstream text;
    text << file.rdbuf();
    if (!file) throw Failure(kFailed, path + ": cannot be read, or is empty");
    return text.str();
}

std::unique_ptr<ModelPeer> start_peer(const Options& options, const Json& config) {
    if (!options.peer) return nullptr;
    std::vector<std::string> command = {
        options.python, options.script.empty() ? find_peer_script() : options.script};
    for (const std::string& word : peer_arguments(config, options.objects)) command.push_back(word);
    command.insert(command.end(),
                   {"--threads", "2", "--isa", options.peer_isa, "--layout", options.peer_layout});
    auto peer = std::make_unique<ModelPeer>(command);
    if (!peer->about().at("openblas").get<bool>())
        throw Failure(kFailed,
                      "the peer has no OpenBLAS, and would be many times slower than PyTorch is: "
                      "`apt-get install libopenblas0-pthread`");
    return peer;
}

Json times_json(const PassTimes& times, double gflop) {
    if (times.times_ms.empty()) return nullptr;
    Json json;
    json["first_ms"] = times.first_ms;
    json["min_ms"] = times.min_ms();
    json["median_ms"] = times.median_ms();
    json["gflop_per_s"] = gflop > 0 ? Json(gflop / times.min_ms() * 1e3) : Json(nullptr);
    json["times_ms"] = times.times_ms;
    return json;
}

Json ratio_json(const PassTimes& peer, const PassTimes& ours) {
    if (peer.times_ms.empty()) return nullptr;
    return peer.min_ms() / ours.min_ms();
}

Json memory_json(splat_device device, const Json& report) {
    auto memory = sized<splat_memory_info>();
    check(splat_device_get_memory(device, &memory));
    Json json = report.at("bytes");
    json["used"] = memory.used_bytes;
    json["live"] = memory.live_bytes;
    json["peak"] = memory.peak_bytes;
    json["budget"] = memory.budget_bytes;
    return json;
}

/// All figures but the device and the profile.
Json result_json(const Options& options, const ModelRun& run, const ModelMeasurement& measured,
                 const ModelPeer* peer) {
    const Json& report = run.report();
    const double gflop = run.gflop();
    const double step_gflop = report.at("config").contains("opt") ? 0 : 3 * gflop;
    Json json;
    json["config"] = report.at("config");
    json["precision"] = options.precision_name;
    json["objects"] = options.objects;
    json["parameters"] = report.at("parameters");
    json["trainable"] = report.at("trainable");
    json["gflop"] = gflop;
    json["create_ms"] = run.create_ms();
    json["init_ms"] = run.init_ms();
    json["forward"] = times_json(measured.forward, gflop);
    json["forward_backward"] = times_json(measured.step, step_gflop);
    json["peer"] = nullptr;
    if (peer != nullptr) {
        json["peer"] = peer->about();
        json["peer"]["forward"] = times_json(measured.peer_forward, gflop);
        json["peer"]["forward_backward"] = times_json(measured.peer_step, step_gflop);
    }
    json["ratio_forward"] = ratio_json(measured.peer_forward, measured.forward);
    json["ratio_forward_backward"] = ratio_json(measured.peer_step, measured.step);
    return json;
}

void add_row(Table& table, const char* pass, const char* who, const Json& times,
             const Json& ratio) {
    if (times.is_null()) return;
    const auto text = [&](const char* key) {
        return times.at(key).is_null() ? "" : format("%.2f", times.at(key).get<double>());
    };
    table.add({std::string("  ") + pass, who, text("first_ms"), text("min_ms"), text("median_ms"),
               text("gflop_per_s"), ratio.is_null() ? "" : format("%.3f", ratio.get<double>())});
}

void print_tables(const Json& json) {
    const Json& memory = json.at("memory");
    const auto bytes = [&](const char* key) {
        return bytes_text(memory.at(key).get<unsigned long long>());
    };
    const auto count = [&](const char* key) { return json.at(key).get<unsigned long long>(); };
    std::printf(
        "%llu parameters, %llu of them trained; %.3f GFLOP forward; precision %s; %llu objects\n",
        count("parameters"), count("trainable"), json.at("gflop").get<double>(),
        json.at("precision").get<std::string>().c_str(), count("objects"));
    std::printf("created in %.1f ms, started at random in %.1f ms\n",
                json.at("create_ms").get<double>(), json.at("init_ms").get<double>());
    std::printf("memory: activations %s, prepared weights %s; device %s, at most %s of %s\n",
                bytes("activations").c_str(), bytes("prepared").c_str(), bytes("used").c_str(),
                bytes("peak").c_str(), bytes("budget").c_str());
    const Json& peer = json.at("peer");
    if (!peer.is_null())
        std::printf("peer: PyTorch %s, %d threads, instructions %s, %s\n",
                    peer.at("torch").get<std::string>().c_str(), peer.at("threads").get<int>(),
                    peer.at("isa").get<std::string>().c_str(),
                    peer.at("layout").get<std::string>().c_str());
    Table table({"  pass", "who", ">first ms", ">min ms", ">median ms", ">GFLOP/s", ">ratio"});
    for (const auto& [key, pass] :
         {std::pair{"forward", "forward"}, std::pair{"forward_backward", "forward + backward"}}) {
        add_row(table, pass, "libsplat", json.at(key), json.at(std::string("ratio_") + key));
        if (!peer.is_null()) add_row(table, pass, "peer", peer.at(key), nullptr);
    }
    std::printf("%s", table.text().c_str());
}

int run(Options options) {
    options.precision = options.precision_name == "strict" ? SPLAT_PRECISION_STRICT
                        : options.precision_name == "fast" ? SPLAT_PRECISION_FAST
                                                           : SPLAT_PRECISION_BALANCED;
    if (!options.file.empty()) options.config = read_text(options.file);
    splat_device_desc desc = device_desc(options.device);
    if (options.profile) desc.flags = SPLAT_DEVICE_PROFILE;
    const Device device = open_device(desc);
    const splat_device_info info = info_of(device.get());
    ModelRun model(device.get(), options);
    const auto peer = start_peer(options, model.report().at("config"));
    const ModelMeasurement measured =
        measure_model(model, peer.get(), options.backward, options.rounds);
    if (options.profile) {
        check(splat_device_profile_reset(device.get()));
        if (options.backward)
            model.step();
        else
            model.forward();
    }
    const auto profile = [&](auto get) {
        return whole_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
            return get(device.get(), buffer, capacity, needed);
        });
    };
    Json json;
    json["library"] = splat_version_string();
    json["device"] = device_json(info);
    json.update(result_json(options, model, measured, peer.get()));
    json["memory"] = memory_json(device.get(), model.report());
    json["profile"] =
        options.profile ? Json::parse(profile(splat_device_profile_json)).at("ops") : Json(nullptr);
    if (options.json) {
        std::printf("%s\n", json_text(json).c_str());
        return kSuccess;
    }
    std::printf("device %u: %s (%s, %s); libsplat %s\n", info.index, info.name,
                kind_name(info.kind), info.driver, splat_version_string());
    print_tables(json);
    if (options.profile) std::printf("\n%s", profile(splat_device_profile_table).c_str());
    return kSuccess;
}

}  // namespace

void add_bench_model(CLI::App& bench, int& exit_code) {
    CLI::App* model = bench.add_subcommand(
        "model", "Time a whole network, forward and backward, alone or in turns with PyTorch.");
    model->group("Commands");
    const auto options = std::make_shared<Options>();
    model->add_option("--config", options->file, "JSON or YAML; else the cars model")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    model->add_option("--precision", options->precision_name, "strict, balanced or fast")
        ->check(CLI::IsMember({"strict", "balanced", "fast"}));
    model->add_option("--objects", options->objects, "Per pass; 1")
        ->check(CLI::Range(1, 4096).description(""));
    model->add_flag("--backward", options->backward, "Also time forward + backward");
    model->add_option("--lora", options->lora, "Train adapters of this rank only")
        ->type_name("RANK")
        ->check(CLI::Range(1, 1024).description(""));
    model->add_flag("--low-memory", options->low_memory, "Prepare weights anew in every pass");
    model->add_option("--rounds", options->rounds, "Calls after the first; 5")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    CLI::Option* peer = model->add_flag("--peer", options->peer, "Take turns with PyTorch");
    model->add_option("--peer-isa", options->peer_isa, "Its instructions: default or avx2")
        ->check(CLI::IsMember({"default", "avx2"}))
        ->needs(peer);
    model->add_option("--peer-layout", options->peer_layout, "channels_last or contiguous")
        ->check(CLI::IsMember({"channels_last", "contiguous"}))
        ->needs(peer);
    model->add_option("--python", options->python, "Its interpreter")->needs(peer);
    model->add_option("--peer-script", options->script, "torch_model.py")
        ->type_name("FILE")
        ->check(CLI::ExistingFile)
        ->needs(peer);
    add_device_option(*model, options->device);
    model->add_flag("--json", options->json, "JSON on standard output");
    model->add_flag("--profile", options->profile, "Add the times by operator");
    model->footer(kFooter);
    model->callback([options, &exit_code] { exit_code = run(*options); });
}

}  // namespace vkrun
