// vkrun stress: numerical stability, by cases that are hard for float32.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/os/path.h"
#include "stress/stress.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/stopwatch.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kStressFooter =
    R"(Runs operators, the rasterizer, networks and trainings on families of inputs that are hard for
float32, with every set of kernels of the device, twice, and compares each result with float64.

  error       of the element that is nearest to its bound or farthest beyond it
  allowed     that bound, derived from the conditions of the computation; [n] is the reason, below
              the table. Both are relative to the largest number of the result.
  peer        --peer: the same element's error in PyTorch's float32; for the rasterizer always,
              by the published formulas in float32
  non-finite  elements that are NaN or infinite where float32 has a value
  wrong       elements that are finite, but farther from float64 than allowed
  verdict     PASS, or FAIL, with (bits) if two runs differ in their bits
  reproduce   the command that runs this case alone

The table has a line for the worst result of each case and for each FAIL; --json has all.

JSON: {library, device, quick, seconds, notes, results: [{case, input, result, kernels, error, allowed,
reason, peer, elements, non_finite, wrong, unequal_bits, passed, reproduce}]}.

Exit status: 0 all pass, 1 a run failed, 2 wrong usage, 3 no device, 6 a result is wrong,
7 a result is not finite.

Examples:
  vkrun stress --quick
  vkrun stress ops --case group_norm/mean_1e4
  vkrun stress raster --svg stress.svg --json > stress.json
)";

struct StressOptions : stress::Options {
    std::vector<std::string> groups;
    std::string svg;
    bool json = false;
    bool peer = false;
    std::string fault_name;
};

constexpr std::pair<const char*, void (*)(stress::Run&)> kGroups[] = {
    {"ops", stress::stress_ops},
    {"raster", stress::stress_raster},
    {"model", stress::stress_model},
    {"train", stress::stress_train}};

/// "stress_time.svg" for "stress.svg".
std::string beside(const std::string& svg) {
    const std::filesystem::path path = splat::os::path_of(svg);
    return splat::os::text_of(path.parent_path() /
                              splat::os::path_of(splat::os::text_of(path.stem()) + "_time.svg"));
}

/// "ops/silu/usual", as the table and messages have it, is the case silu/usual of the group ops.
void split_group(StressOptions& options) {
    for (const auto& [name, stress_group] : kGroups) {
        const std::string prefix = std::string(name) + "/";
        if (options.only.rfind(prefix, 0) != 0) continue;
        const auto& chosen = options.groups;
        if (!chosen.empty() && std::find(chosen.begin(), chosen.end(), name) == chosen.end())
            throw Failure(kUsageError,
                          "--case '" + options.only + "' is of a group that is not chosen");
        options.groups = {name};
        options.only.erase(0, prefix.size());
        return;
    }
}

int run_stress(const CLI::App& command, StressOptions options) {
    if (command.count("--case") != 0 && options.only.empty())
        throw Failure(kUsageError, "--case is empty, expected a name of the table's first column");
    split_group(options);
    if (!options.svg.empty()) check_folder_of(options.svg);
    if (!options.peer) options.python.clear();
    if (!options.fault_name.empty())
        options.fault = options.fault_name == "nan" ? stress::Fault::kNan : stress::Fault::kWorse;
    const Stopwatch watch;
    stress::Run run(options);
    for (const auto& [name, stress_group] : kGroups) {
        const bool chosen =
            options.groups.empty() ||
            std::find(options.groups.begin(), options.groups.end(), name) != options.groups.end();
        if (chosen) stress_group(run);
    }
    if (options.hashes) {
        std::printf("ready %s\n", Json(run.hashes()).dump().c_str());
        return kSuccess;
    }
    if (run.rows().empty())
        throw Failure(kUsageError, "there is no case '" + options.only +
                                       "'; the first column of 'vkrun stress' names them");
    const splat_device_info info = info_of(run.devices().front().device.get());
    if (!options.svg.empty()) {
        write_text(options.svg, stress::stress_svg(run.rows(), device_sentence(info)));
        write_text(beside(options.svg), stress::tradeoff_svg(run, device_sentence(info)));
    }
    if (options.json) {
        Json json;
        json["library"] = splat_version_string();
        json["device"] = device_json(info);
        json["quick"] = options.quick;
        json["seconds"] = watch.seconds();
        json["notes"] = run.notes();
        json["results"] = stress::stress_json(run.rows());
        print_json(json);
    } else {
        std::printf("%s; %.1f s\n\n%s", device_sentence(info).c_str(), watch.seconds(),
                    stress::stress_table(run.rows()).c_str());
        for (const std::string& note : run.notes()) std::printf("note: %s\n", note.c_str());
    }
    return stress::exit_code_of(run.rows());
}

}  // namespace

void add_stress(CLI::App& app, int& exit_code) {
    CLI::App* command = add_command(app, "stress", kStressSentence, kStressFooter);
    const auto options = std::make_shared<StressOptions>();
    options->python = "/usr/bin/python3";
    command
        ->add_option("GROUP", options->groups, "ops, raster, model or train; default: all of them")
        ->type_name("")
        ->check(one_of({"ops", "raster", "model", "train"}));
    command->add_flag("--quick", options->quick, "Fewer and smaller inputs, at most 30 s");
    command
        ->add_option("--case", options->only,
                     "Only this case, or those below it: silu, silu/usual or,\nas in the table, "
                     "ops/silu/usual")
        ->type_name("NAME");
    CLI::Option* peer =
        command->add_flag("--peer", options->peer, "Also compute in PyTorch's float32");
    command->add_option("--python", options->python, "Python interpreter of the peer")
        ->type_name("PROGRAM")
        ->capture_default_str()
        ->needs(peer);
    add_device_option(*command, options->device);
    add_json_flag(*command, options->json);
    command
        ->add_option("--svg", options->svg,
                     "Also draw the errors of all results, and, in a file\nwhose name ends in "
                     "_time.svg, run time against error")
        ->type_name("FILE");
    command->add_flag("--hashes", options->hashes, "")
        ->group("");  // the processes of train/threads
    command
        ->add_option("--fault", options->fault_name, "")  // for tests: falsify every result
        ->group("")
        ->check(one_of({"worse", "nan"}));
    command->callback(
        [command, options, &exit_code] { exit_code = run_stress(*command, *options); });
}

}  // namespace vkrun
