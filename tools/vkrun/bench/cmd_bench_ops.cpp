// vkrun bench ops: the speed and the errors of the operators on this device.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "bench/ops/op_bench.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"

namespace vkrun {
namespace {

constexpr const char* kBenchOpsFooter =
    R"(Runs every operator on the shapes of the network, forward and backward, with the plain and the
fast kernels of the device alternately (A B A B) in this one process.

  runs               how often each ran: --repeat times, or fewer once --seconds have passed
  min ms, median ms  device time of the operator's own dispatches over the runs
  GB/s, GFLOP/s      bytes that must be moved, or operations that must be done, per second of
                     the shortest run; plain and fast have the same numerator
  plain/fast         shortest plain run over shortest fast run: above 1, fast is faster
  rel. L2            norm of the difference to float64 over the norm of the float64 result
  max error          largest difference of an element to float64; both over all results
  layout ms          packing and unpacking (median), which a network does once at its edges and
                     when a weight changes; not in the other figures

conv2d is compared with float64 at 256 elements of y, grad_x and grad_weight. Its GFLOP/s count the
operations of the definition; Winograd's algorithms do fewer. An adapter (LoRA) is two of its cases,
3x3 to 4 channels and 1x1 from there.

JSON: {library, device, kernels, repeat, notes, results: [{op, case, attributes, shapes,
direction, bytes, flops, plain, fast, ratio_min, ratio_median}]}; 'plain' and 'fast' hold the
figures above, the errors by tensor, the time of every run, the dispatches of the last run, and
max_roundings: the largest error in units of 2^-24 * (1 + sqrt(K)) * S for a sum of K terms
whose magnitudes add up to S. More than 4 is a wrong result.

Exit status: 0 all results are right, 1 a result is wrong or a run failed, 2 wrong usage,
3 no device.

Examples:
  vkrun bench ops --only linear --repeat 30
  vkrun bench ops --device discrete --json > bench.json
)";

struct BenchOpsOptions {
    std::vector<std::string> only;
    std::string device = "best";
    int repeat = 0;
    double seconds = 4;
    bool json = false;
    bool table = false;
    bool quick = false;
    bool list = false;
};

Device open_with(const BenchOpsOptions& options, splat_kernels kernels) {
    splat_device_desc desc = device_desc(options.device);
    desc.kernels = kernels;
    desc.flags = SPLAT_DEVICE_PROFILE;
    return open_device(desc);
}

Json report_json(const splat_device_info& plain, const splat_device_info& fast, int repeat,
                 const std::vector<std::string>& notes,
                 const std::vector<bench::Measurement>& measurements) {
    Json document;
    document["library"] = splat_version_string();
    document["device"] = device_json(fast);
    document["kernels"]["plain"] = kernels_name(plain.kernels);
    document["kernels"]["fast"] = kernels_name(fast.kernels);
    document["same_kernels"] = plain.kernels == fast.kernels;
    document["repeat"] = repeat;
    document["notes"] = notes;
    document["results"] = Json::array();
    for (const bench::Measurement& measurement : measurements)
        document["results"].push_back(bench::measurement_json(measurement));
    return document;
}

void print_table(const splat_device_info& info, int repeat, const std::vector<std::string>& notes,
                 const std::vector<bench::Measurement>& measurements) {
    std::printf("%s; up to %d runs of each, alternately\n", device_sentence(info).c_str(), repeat);
    for (const std::string& note : notes) std::printf("note: %s\n", note.c_str());
    std::printf("\n%s", bench::measurement_table(measurements).c_str());
}

/// The cases without their values.
Json cases_json(const std::vector<std::string>& ops, bool quick) {
    Json cases = Json::array();
    for (const std::string& op : ops)
        for (const OpCase& one : bench::bench_cases(op, quick)) {
            Json row = {{"op", op}, {"case", one.title}, {"attributes", one.attributes}};
            for (const CaseTensor& input : one.inputs)
                row["inputs"].push_back(
                    {{"name", input.name}, {"dims", input.dims}, {"constant", input.constant}});
            for (const CaseTensor& output : one.outputs)
                row["outputs"].push_back({{"name", output.name}, {"dims", output.dims}});
            cases.push_back(std::move(row));
        }
    return cases;
}

/// Check of --only: empty if the library has the operator, else what is wrong.
std::string check_op(const std::string& name) {
    std::string names;
    for (const std::string& op : bench::bench_ops()) {
        if (op == name) return {};
        names += (names.empty() ? "" : ", ") + op;
    }
    return "no operator '" + name + "'; there are: " + names;
}

int run_ops(BenchOpsOptions options) {
    check_number("--seconds", options.seconds, 0, 1e6);
    if (options.only.empty()) options.only = bench::bench_ops();
    if (options.list) {
        print_json(cases_json(options.only, options.quick));
        return kSuccess;
    }
    if (options.repeat == 0) options.repeat = options.quick ? 2 : 10;
    const bench::BenchDevices devices{open_with(options, SPLAT_KERNELS_PLAIN),
                                      open_with(options, SPLAT_KERNELS_AUTO)};
    const splat_device_info plain = info_of(devices.plain.get());
    const splat_device_info fast = info_of(devices.fast.get());
    std::vector<bench::Measurement> measurements;
    for (const std::string& op : options.only)
        for (const OpCase& op_case : bench::bench_cases(op, options.quick)) {
            std::fprintf(stderr, "bench: %s %s\n", op.c_str(), op_case.title.c_str());
            for (bench::Measurement& one :
                 bench::measure(devices, op_case, {options.repeat, options.seconds}))
                measurements.push_back(std::move(one));
        }
    const std::vector<std::string> notes = bench::notes_on(plain, fast);
    if (options.json)
        print_json(report_json(plain, fast, options.repeat, notes, measurements));
    else
        print_table(fast, options.repeat, notes, measurements);
    const std::vector<std::string> wrong = bench::wrong_results(measurements);
    std::fflush(stdout);
    for (const std::string& sentence : wrong) std::fprintf(stderr, "vkrun: %s\n", sentence.c_str());
    return wrong.empty() ? kSuccess : kFailed;
}

/// For the help: all names, a few per line.
std::string names_of_ops() {
    std::string text;
    std::size_t width = 0;
    for (const std::string& op : bench::bench_ops()) {
        const bool wrap = width + op.size() > 44;
        text += text.empty() ? "" : wrap ? ",\n" : ", ";
        width = (wrap ? 0 : width) + op.size() + 2;
        text += op;
    }
    return text;
}

}  // namespace

void add_bench_ops(CLI::App& bench, int& exit_code) {
    CLI::App* ops = add_command(
        bench, "ops", "Time fast kernels against plain ones, and compare both with float64.",
        kBenchOpsFooter);
    const auto options = std::make_shared<BenchOpsOptions>();
    ops->add_option("--only", options->only,
                    "Operators to measure; default: all of\n" + names_of_ops())
        ->type_name("OP[,OP]...")
        ->delimiter(',')
        ->allow_extra_args(false)
        ->check(CLI::Validator(check_op, ""));
    ops->add_option("--repeat", options->repeat,
                    "Runs of each set of kernels at most; default: 10,\nwith --quick 2")
        ->type_name("N")
        ->check(CLI::Range(1, 10000).description(""));
    ops->add_option(
           "--seconds", options->seconds,
           "Stop repeating a case in one direction after S seconds,\nbut not before 3 runs")
        ->type_name("S")
        ->default_str("4")
        ->check(CLI::Range(0.0, 1e6).description(""));
    add_device_option(*ops, options->device);
    ops->add_flag("--quick", options->quick, "Measure one small shape per operator, as a check");
    ops->add_flag("--list", options->list, "Print the cases as JSON instead: shapes, attributes");
    ops->add_flag("--table", options->table, "Print tables (the default)");
    add_json_flag(*ops, options->json);
    ops->callback([options, &exit_code] {
        if (options->json && options->table) throw CLI::ExcludesError("--json", "--table");
        exit_code = run_ops(*options);
    });
}

}  // namespace vkrun
