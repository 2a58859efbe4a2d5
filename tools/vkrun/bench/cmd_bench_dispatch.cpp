// vkrun bench dispatch: what Vulkan itself costs on this device, and the ceilings of its kernels.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/dispatch/dispatch_bench.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"

namespace vkrun {
namespace {

constexpr const char* kBenchDispatchFooter =
    R"(Small shaders of this command run on the device, without libsplat's kernels between: what simple
kernels reach, and what every dispatch costs. Each figure has the shortest and the median of 7 runs.

  copy             a kernel, and vkCmdCopyBuffer, between buffers larger than the caches: bytes read
                   and written together
  multiply-adds    8, 16 or 32 of them in flight in each invocation, the best; two operations each
  shuffles         of a subgroup, with an addition each, counted per lane
  chain            1000 dispatches of one workgroup that does nothing, in one submission; 'barrier of
                   command lists' is the one that libsplat records, with transfers and indirect commands
  bound each time  the pipeline, its buffers and push constants before each dispatch, as libsplat does
  us to record     on the host, for each dispatch
  mapped memory    by the host, 16 MiB, and its first 4 bytes, of each kind that the device has

JSON: {library, device, memory: {heaps, types}, lanes: [smallest, largest], timestamp_ns, extensions,
ceilings, chains: [{chain, us, record_us}], submit_us, submit_empty_list_us, mapped}.

Exit status: 0 success, 1 a run failed, 2 wrong usage, 3 no device.

Examples:
  vkrun bench dispatch
  vkrun bench dispatch --device discrete --json > dispatch.json
)";

struct BenchDispatchOptions {
    std::string device = "best";
    bool describe = false;
    bool json = false;
};

int run_bench_dispatch(const BenchDispatchOptions& options) {
    const Device device = open_device(device_desc(options.device));
    const splat_device_info info = info_of(device.get());
    const Json measured = bench::measure_dispatch(info, !options.describe);
    if (!options.json) {
        std::printf("%s\n\n%s", device_sentence(info).c_str(),
                    bench::dispatch_table(measured).c_str());
        return kSuccess;
    }
    Json json;
    json["library"] = splat_version_string();
    json["device"] = device_json(info);
    json.update(measured);
    print_json(json);
    return kSuccess;
}

}  // namespace

void add_bench_dispatch(CLI::App& bench, int& exit_code) {
    CLI::App* dispatch =
        add_command(bench, "dispatch", "Time empty dispatches, submissions, copies and arithmetic.",
                    kBenchDispatchFooter);
    const auto options = std::make_shared<BenchDispatchOptions>();
    add_device_option(*dispatch, options->device);
    add_json_flag(*dispatch, options->json);
    dispatch
        ->add_flag("--describe", options->describe,
                   "Measure nothing: memory, lanes and extensions; needs --json")
        ->needs("--json");
    dispatch->callback([options, &exit_code] { exit_code = run_bench_dispatch(*options); });
}

}  // namespace vkrun
