// vkrun bench model: how fast a whole network runs, alone or alternating with PyTorch.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/model/model_errors.h"
#include "bench/model/model_report.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/config/merged_config.h"

namespace vkrun {
namespace {

constexpr const char* kBenchModelFooter =
    R"(A network with random weights runs forward and, with --backward, forward and backward with a gradient of 1
for every output. Times are wall times of the calls, with inputs and their checks. The forward pass alone runs
on a model without gradients, which keeps prepared weights from its second pass on. A model that trains
prepares them in every pass.

  first ms           the first call: kernels are compiled or found in the cache
  second ms          the second call: prepares weights, and takes memory for them, if they are kept
  min ms, median ms  of --rounds further calls
  GFLOP/s            of the shortest call: convolutions and products of attention, two operations
                     per multiplication of a direct convolution; forward + backward counts as three
                     forward passes; none with adapters
  peer               --peer: the same network in PyTorch, in a process of
                     tools/bench/torch_model.py; both run alternately (A B A B). It runs on the CPU
                     with 2 threads, or with --peer-device cuda on the GPU, in real float32 unless
                     --peer-tf32 is given, its inputs there already; its times end when the GPU is
                     done. With --peer-graphs its first call captures a CUDA graph, the others
                     replay it
  ratio              the peer's shortest time over ours: above 1, libsplat is faster
  memory             activations and prepared weights of each model; the total of the device
  --profile          times of one more pass by operator, and between dispatches; every pass then
                     has timestamps, which on lavapipe take longer than what is between dispatches
  --errors           instead: forward passes of every precision and of the peer alternately, on the
                     same weights, with their errors against PyTorch in float64 on the peer's
                     device: relative L2 of the network's raw output, and the largest error of
                     any attribute of a Gaussian

JSON: {library, device, config, precision, objects, parameters, trainable, gflop, forward,
forward_backward, peer, ratio_forward, ratio_forward_backward, profile, lists, memory}; figures that were not
requested are null; "lists" is what each pass of --profile submitted. With --errors: {library, device, config,
objects, parameters, gflop, peer, errors}.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device, 4 a file cannot be read.

Examples:
  vkrun bench model --backward --peer
  vkrun bench model --backward --peer --peer-device cuda --peer-graphs --python python3
  vkrun bench model --errors --svg errors.svg
  vkrun bench model --config config.yaml --lora 8 --backward --precision fast --json
)";

struct BenchModelOptions : bench::ModelBenchOptions {
    std::string file;
    std::string precision_name = "balanced";
    std::string device = "best";
    std::string svg;
    bool errors = false;
    bool json = false;
};

int run_errors(splat_device device, Json json, const BenchModelOptions& options) {
    const bench::ErrorMeasurement measured = bench::measure_errors(device, options);
    const auto parameters = measured.model.at("parameters").get<unsigned long long>();
    write_text(
        options.svg,
        bench::errors_svg(measured.rows,
                          format("%llu parameters, %.1f GFLOP, %s", parameters, measured.gflop,
                                 json.at("device").at("name").get<std::string>().c_str())));
    if (options.json) {
        json["config"] = measured.model.at("config");
        json["objects"] = options.objects;
        json["parameters"] = parameters;
        json["gflop"] = measured.gflop;
        json["peer"] = measured.peer;
        json["errors"] = bench::errors_json(measured.rows);
        print_json(json);
        return kSuccess;
    }
    std::printf("%llu parameters; %.3f GFLOP; %u objects; errors against PyTorch in float64\n",
                parameters, measured.gflop, options.objects);
    bench::print_peer(measured.peer);
    std::printf("%s", bench::errors_table(measured.rows).c_str());
    return kSuccess;
}

int run_bench_model(BenchModelOptions options) {
    check_target(options.svg, true, {options.file});
    check_folder_of(options.svg);
    options.precision = options.precision_name == "strict" ? SPLAT_PRECISION_STRICT
                        : options.precision_name == "fast" ? SPLAT_PRECISION_FAST
                                                           : SPLAT_PRECISION_BALANCED;
    if (!options.file.empty()) options.config = config_text(options.file);
    splat_device_desc desc = device_desc(options.device);
    if (options.profile) desc.flags = SPLAT_DEVICE_PROFILE;
    const Device device = open_device(desc);
    const splat_device_info info = info_of(device.get());
    Json json;
    json["library"] = splat_version_string();
    json["device"] = device_json(info);
    if (options.errors) {
        if (!options.json) std::printf("%s\n", device_sentence(info).c_str());
        return run_errors(device.get(), std::move(json), options);
    }
    bench::measure_passes(json, device.get(), options);
    if (options.json) {
        print_json(json);
        return kSuccess;
    }
    std::printf("%s\n", device_sentence(info).c_str());
    bench::print_passes(json);
    if (options.profile)
        std::printf("\n%s",
                    library_text([&](char* buffer, std::size_t capacity, std::size_t* needed) {
                        return splat_device_profile_table(device.get(), buffer, capacity, needed);
                    }).c_str());
    return kSuccess;
}

void add_peer_options(CLI::App& model, bench::PeerOptions& peer) {
    model.add_option("--peer-device", peer.device, "Device of the peer: cpu or cuda")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"cpu", "cuda"}));
    model.add_flag("--peer-tf32", peer.tf32, "Let a peer with CUDA round factors to TF32");
    model.add_flag("--peer-graphs", peer.graphs,
                   "Let a peer with CUDA replay its passes as graphs");
    model
        .add_option("--peer-isa", peer.isa,
                    "Instruction set of a peer on the CPU: default (all) or avx2")
        ->type_name("NAME")
        ->check(one_of({"default", "avx2"}));
    model
        .add_option("--peer-layout", peer.layout,
                    "Layout of the peer's tensors: channels_last or contiguous;\n"
                    "default: channels_last")
        ->type_name("NAME")
        ->check(one_of({"channels_last", "contiguous"}));
    model.add_option("--python", peer.python, "Python interpreter of the peer")
        ->type_name("PROGRAM")
        ->capture_default_str();
    model
        .add_option("--peer-script", peer.script,
                    "Script of the peer; default: tools/bench/torch_model.py")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""));
}

}  // namespace

void add_bench_model(CLI::App& bench, int& exit_code) {
    CLI::App* model = add_command(
        bench, "model",
        "Time a whole network, forward and backward, alone or alternating with PyTorch.",
        kBenchModelFooter);
    const auto options = std::make_shared<BenchModelOptions>();
    model
        ->add_option("--config", options->file,
                     "Configuration, YAML or JSON; default: the cars model")
        ->type_name("FILE")
        ->check(CLI::ExistingFile.description(""));
    model->add_option("--precision", options->precision_name, "strict, balanced or fast")
        ->type_name("NAME")
        ->capture_default_str()
        ->check(one_of({"strict", "balanced", "fast"}));
    model->add_option("--objects", options->objects, "Objects of a batch")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 4096).description(""));
    CLI::Option* backward =
        model->add_flag("--backward", options->backward, "Also time forward + backward");
    model
        ->add_flag("--recompute", options->recompute,
                   "Recompute activations in the backward pass, which takes less\n"
                   "memory; needs --backward")
        ->needs(backward);
    model->add_option("--lora", options->lora, "Train only adapters, of this rank")
        ->type_name("RANK")
        ->check(CLI::Range(1, 1024).description(""));
    model->add_flag("--low-memory", options->low_memory,
                    "Prepare weights in every pass, which takes less memory");
    model->add_option("--rounds", options->rounds, "Timed calls, after two others")
        ->type_name("N")
        ->capture_default_str()
        ->check(CLI::Range(1, 10000).description(""));
    model->add_flag("--peer", options->with_peer, "Alternate with the same network in PyTorch");
    model->add_flag("--profile", options->profile, "Add the times by operator, of one more pass");
    CLI::Option* errors =
        model->add_flag("--errors", options->errors,
                        "Compare time and error of every precision and of PyTorch;\n"
                        "excludes --precision, --backward, --recompute, --lora,\n"
                        "--low-memory, --peer and --profile");
    for (const char* other : {"--precision", "--backward", "--recompute", "--lora", "--low-memory",
                              "--peer", "--profile"})
        errors->excludes(other);
    model->add_option("--svg", options->svg, "Draw the comparison of --errors")
        ->type_name("FILE")
        ->needs(errors);
    add_peer_options(*model, options->peer);
    add_device_option(*model, options->device);
    add_json_flag(*model, options->json);
    model->callback([options, model, &exit_code] {
        for (const char* of_peer : {"--peer-device", "--peer-tf32", "--peer-graphs", "--peer-isa",
                                    "--peer-layout", "--python", "--peer-script"})
            if (model->count(of_peer) > 0 && !options->with_peer && !options->errors)
                throw Failure(kUsageError, std::string(of_peer) + " needs --peer or --errors");
        bench::check_peer_options(options->peer);
        exit_code = run_bench_model(*options);
    });
}

}  // namespace vkrun
