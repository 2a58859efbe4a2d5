// vkrun bench model: how fast a whole network runs, alone or in turns with PyTorch.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "vkrun/command.h"
#include "vkrun/model/model_errors.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

constexpr const char* kBenchModelFooter =
    R"(A network with random weights runs forward and, with --backward, forward and backward with all
gradients of outputs 1; wall time of the calls, inputs and their checks included. Forward alone is that
of a model made without gradients, which keeps prepared weights from its second pass on; one that
trains prepares them anew.

  first ms           the first call: kernels are compiled or found in the cache
  second ms          the second: where weights are kept, it takes memory for them and prepares them
  min ms, median ms  of --rounds further calls
  GFLOP/s            of the shortest: convolutions and products of attention, two operations per
                     multiplication as a direct convolution needs them; forward + backward counts
                     as three forward passes, and not at all with adapters
  peer               --peer: the same network in PyTorch, on the CPU with 2 threads, in a process
                     of tools/bench/torch_model.py; both take turns (A B A B)
  ratio              the peer's shortest time over ours: above 1, libsplat is faster
  memory             activations and prepared weights of each model; all that the device holds
  --profile          times of one more pass by operator; every pass then has timestamps
  --errors           instead: forward passes of every precision and of the peer in turns, on the same
                     weights, with their errors against PyTorch in float64: of the network's raw
                     output (L2, relative) and the largest of any number of a Gaussian

JSON: {library, device, config, precision, objects, parameters, trainable, gflop, forward,
forward_backward, peer, ratio_forward, ratio_forward_backward, profile, memory}; what was not asked
for is null. With --errors: {library, device, config, objects, parameters, gflop, peer, errors}.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device, 4 a file cannot be read.

Examples:
  vkrun bench model --backward --peer
  vkrun bench model --errors --svg errors.svg
  vkrun bench model --config config.yaml --lora 8 --backward --precision fast --json
)";

struct BenchModelOptions : ModelBenchOptions {
    std::string file;
    std::string precision_name = "balanced";
    std::string device = "best";
    std::string peer_isa = "default";
    std::string peer_layout = "channels_last";
    std::string python = "/usr/bin/python3";  // where Debian's python3-torch is found
    std::string script;
    std::string svg;
    bool peer = false;
    bool errors = false;
    bool json = false;
    bool profile = false;
};

std::vector<std::string> peer_command(const BenchModelOptions& options, const Json& config) {
    std::vector<std::string> command = {
        options.python, options.script.empty() ? find_peer_script() : options.script};
    for (const std::string& word : peer_arguments(config, options.objects)) command.push_back(word);
    command.insert(command.end(),
                   {"--threads", "2", "--isa", options.peer_isa, "--layout", options.peer_layout});
    return command;
}

std::unique_ptr<ModelPeer> start_peer(const BenchModelOptions& options, const Json& config) {
    if (!options.peer) return nullptr;
    auto peer = std::make_unique<ModelPeer>(peer_command(options, config), kPeerRemedy);
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
    json["second_ms"] = times.second_ms;
    json["min_ms"] = times.min_ms();
    json["median_ms"] = times.median_ms();
    json["gflop_per_s"] = gflop > 0 ? Json(gflop / times.min_ms() * 1e3) : Json(nullptr);
    json["times_ms"] = times.times_ms;
    return json;
}

Json memory_json(splat_device device) {
    auto memory = sized<splat_memory_info>();
    check(splat_device_get_memory(device, &memory));
    Json json;
    json["used"] = memory.used_bytes;
    json["live"] = memory.live_bytes;
    json["peak"] = memory.peak_bytes;
    json["budget"] = memory.budget_bytes;
    return json;
}

/// The figures of one kind of pass go below its key, those of the peer below "peer".
void add_pass(Json& json, const char* key, ModelRun& run, ModelPeer* peer,
              const BenchModelOptions& options) {
    const bool step = std::string(key) == "forward_backward";
    const PassMeasurement measured = measure_pass(run, peer, step, options.rounds);
    const bool in_part = run.report().at("config").contains("opt");
    const double forward = json.at("gflop").get<double>();
    const double gflop = !step ? forward : in_part ? 0 : 3 * forward;
    json[key] = times_json(measured.ours, gflop);
    json[key]["bytes"] = run.report().at("bytes");
    json[key]["create_ms"] = run.create_ms();
    json[key]["init_ms"] = run.init_ms();
    if (peer == nullptr) return;
    json["peer"][key] = times_json(measured.peer, gflop);
    json[std::string("ratio_") + key] = measured.peer.min_ms() / measured.ours.min_ms();
}

void describe(Json& json, const ModelRun& run, const BenchModelOptions& options) {
    json["config"] = run.report().at("config");
    json["precision"] = options.precision_name;
    json["objects"] = options.objects;
    json["parameters"] = run.report().at("parameters");
    json["trainable"] = run.report().at("trainable");
    json["gflop"] = run.gflop();
    for (const char* key : {"forward", "forward_backward", "peer", "ratio_forward",
                            "ratio_forward_backward", "profile"})
        json[key] = nullptr;
}

std::string profile_text(splat_device device,
                         splat_result (*get)(splat_device, char*, std::size_t, std::size_t*)) {
    return whole_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
        return get(device, buffer, capacity, needed);
    });
}

/// Both kinds of passes, each on a model of its own, one after the other; the profile is that of one
/// more pass of the last.
void measure(Json& json, splat_device device, const BenchModelOptions& options) {
    std::unique_ptr<ModelPeer> peer;
    for (const bool step : {false, true}) {
        if (step && !options.backward) return;
        ModelBenchOptions made = options;
        made.backward = step;
        ModelRun run(device, made);
        if (!step) {
            describe(json, run, options);
            peer = start_peer(options, run.report().at("config"));
            if (peer != nullptr) {
                json["peer"] = peer->about();
                json["peer"]["forward"] = json["peer"]["forward_backward"] = nullptr;
            }
        }
        add_pass(json, step ? "forward_backward" : "forward", run, peer.get(), options);
        json["memory"] = memory_json(device);
        if (!options.profile || step != options.backward) continue;
        check(splat_device_profile_reset(device));
        step ? run.step() : run.forward();
        json["profile"] = Json::parse(profile_text(device, splat_device_profile_json)).at("ops");
    }
}

void add_row(Table& table, const char* pass, const char* who, const Json& times,
             const Json& ratio) {
    if (times.is_null()) return;
    const auto text = [&](const char* key) {
        return times.at(key).is_null() ? "" : format("%.2f", times.at(key).get<double>());
    };
    table.add({std::string("  ") + pass, who, text("first_ms"), text("second_ms"), text("min_ms"),
               text("median_ms"), text("gflop_per_s"),
               ratio.is_null() ? "" : format("%.3f", ratio.get<double>())});
}

void print_peer(const Json& peer) {
    std::printf("peer: PyTorch %s, %d threads, instructions %s, %s\n",
                peer.at("torch").get<std::string>().c_str(), peer.at("threads").get<int>(),
                peer.at("isa").get<std::string>().c_str(),
                peer.at("layout").get<std::string>().c_str());
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
    for (const char* key : {"forward", "forward_backward"}) {
        const Json& pass = json.at(key);
        if (pass.is_null()) continue;
        const auto size = [&](const char* of) {
            return bytes_text(pass.at("bytes").at(of).get<unsigned long long>());
        };
        std::printf(
            "%s: created in %.1f ms, started at random in %.1f ms; activations %s, "
            "prepared weights %s\n",
            key, pass.at("create_ms").get<double>(), pass.at("init_ms").get<double>(),
            size("activations").c_str(), size("prepared").c_str());
    }
    std::printf("device memory: %s, at most %s of %s\n", bytes("used").c_str(),
                bytes("peak").c_str(), bytes("budget").c_str());
    const Json& peer = json.at("peer");
    if (!peer.is_null()) print_peer(peer);
    Table table({"  pass", "who", ">first ms", ">second ms", ">min ms", ">median ms", ">GFLOP/s",
                 ">ratio"});
    for (const auto& [key, pass] :
         {std::pair{"forward", "forward"}, std::pair{"forward_backward", "forward + backward"}}) {
        add_row(table, pass, "libsplat", json.at(key), json.at(std::string("ratio_") + key));
        if (!peer.is_null()) add_row(table, pass, "peer", peer.at(key), nullptr);
    }
    std::printf("%s", table.text().c_str());
}

int run_errors(splat_device device, Json json, const BenchModelOptions& options) {
    const ErrorMeasurement measured = measure_errors(
        device, options, [&](const Json& config) { return peer_command(options, config); });
    const auto parameters = measured.model.at("parameters").get<unsigned long long>();
    write_text(options.svg,
               errors_svg(measured.rows,
                          format("%llu parameters, %.1f GFLOP, %s", parameters, measured.gflop,
                                 json.at("device").at("name").get<std::string>().c_str())));
    if (options.json) {
        json["config"] = measured.model.at("config");
        json["objects"] = options.objects;
        json["parameters"] = parameters;
        json["gflop"] = measured.gflop;
        json["peer"] = measured.peer;
        json["errors"] = errors_json(measured.rows);
        std::printf("%s\n", json_text(json).c_str());
        return kSuccess;
    }
    std::printf("%llu parameters; %.3f GFLOP; %u objects; errors against PyTorch in float64\n",
                parameters, measured.gflop, options.objects);
    print_peer(measured.peer);
    std::printf("%s", errors_table(measured.rows).c_str());
    return kSuccess;
}

int run_bench_model(BenchModelOptions options) {
    options.precision = options.precision_name == "strict" ? SPLAT_PRECISION_STRICT
                        : options.precision_name == "fast" ? SPLAT_PRECISION_FAST
                                                           : SPLAT_PRECISION_BALANCED;
    if (!options.file.empty()) options.config = read_text(options.file);
    splat_device_desc desc = device_desc(options.device);
    if (options.profile) desc.flags = SPLAT_DEVICE_PROFILE;
    const Device device = open_device(desc);
    const splat_device_info info = info_of(device.get());
    Json json;
    json["library"] = splat_version_string();
    json["device"] = device_json(info);
    const auto print_device = [&] {
        std::printf("device %u: %s (%s, %s); libsplat %s\n", info.index, info.name,
                    kind_name(info.kind), info.driver, splat_version_string());
    };
    if (options.errors) {
        if (!options.json) print_device();
        return run_errors(device.get(), std::move(json), options);
    }
    measure(json, device.get(), options);
    if (options.json) {
        std::printf("%s\n", json_text(json).c_str());
        return kSuccess;
    }
    print_device();
    print_tables(json);
    if (options.profile)
        std::printf("\n%s", profile_text(device.get(), splat_device_profile_table).c_str());
    return kSuccess;
}

}  // namespace

void add_bench_model(CLI::App& bench, int& exit_code) {
    CLI::App* model = bench.add_subcommand(
        "model", "Time a whole network, forward and backward, alone or in turns with PyTorch.");
    model->group("Commands");
    const auto options = std::make_shared<BenchModelOptions>();
    model->add_option("--config", options->file, "JSON or YAML; else the cars model")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    model->add_option("--precision", options->precision_name, "strict, balanced or fast")
        ->check(CLI::IsMember({"strict", "balanced", "fast"}));
    model->add_option("--objects", options->objects, "Of a batch; 1")
        ->check(CLI::Range(1, 4096).description(""));
    CLI::Option* backward =
        model->add_flag("--backward", options->backward, "Also time forward + backward");
    model->add_flag("--recompute", options->recompute, "SPLAT_MODEL_RECOMPUTE")->needs(backward);
    model->add_option("--lora", options->lora, "Train adapters of this rank only")
        ->type_name("RANK")
        ->check(CLI::Range(1, 1024).description(""));
    model->add_flag("--low-memory", options->low_memory, "Prepare weights anew in every pass");
    model
        ->add_option("--rounds", options->rounds,
                     "Timed calls, after two that are not among them; 5")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    model->add_flag("--peer", options->peer, "Take turns with PyTorch");
    CLI::Option* errors =
        model->add_flag("--errors", options->errors, "Run time against error, by precision");
    for (const char* other :
         {"--precision", "--backward", "--recompute", "--lora", "--low-memory", "--peer"})
        errors->excludes(other);
    model->add_option("--svg", options->svg, "Draw it")->type_name("FILE")->needs(errors);
    model->add_option("--peer-isa", options->peer_isa, "Its instructions: default or avx2")
        ->check(CLI::IsMember({"default", "avx2"}));
    model->add_option("--peer-layout", options->peer_layout, "channels_last or contiguous")
        ->check(CLI::IsMember({"channels_last", "contiguous"}));
    model->add_option("--python", options->python, "The peer's interpreter");
    model->add_option("--peer-script", options->script, "torch_model.py")
        ->type_name("FILE")
        ->check(CLI::ExistingFile);
    add_device_option(*model, options->device);
    model->add_flag("--json", options->json, "JSON on standard output");
    model->add_flag("--profile", options->profile, "Add the times by operator");
    model->footer(kBenchModelFooter);
    model->callback([options, model, &exit_code] {
        for (const char* of_peer : {"--peer-isa", "--peer-layout", "--python", "--peer-script"})
            if (model->count(of_peer) > 0 && !options->peer && !options->errors)
                throw Failure(kUsageError, std::string(of_peer) + " needs --peer or --errors");
        exit_code = run_bench_model(*options);
    });
}

}  // namespace vkrun
