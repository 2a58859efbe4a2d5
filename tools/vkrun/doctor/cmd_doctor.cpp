// vkrun doctor: what works on this machine, what does not, and how to fix it.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <memory>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/doctor/doctor.h"

namespace vkrun {
namespace {

constexpr const char* kDoctorFooter =
    R"(Checks the library, the Vulkan loader and drivers, the devices and the choice among them, the
chosen device's limits, kernels and memory, environment variables, the validation layer and the
folder of the pipeline cache. A self-test writes and reads a tensor, counts its NaNs, and
compares operators, forward and backward, with float64.

Each finding is ok, a warning (libsplat works, but something could be better) or an error.
Warnings and errors come with a remedy. Package names are those of Debian 12.

JSON: {library, state, exit_status, device, findings: [{check, state, sentence, remedy}]};
device is null when none could be opened.

Exit status: 0 no errors (there may be warnings), 1 errors, 2 wrong usage, 3 no loader, driver
or usable device.

Examples:
  vkrun doctor
  vkrun doctor --device cpu --json
)";

struct DoctorOptions {
    std::string device = "best";
    bool quick = false;
    bool json = false;
};

const char* state_name(State state) {
    return state == State::kOk ? "ok" : state == State::kWarning ? "warning" : "error";
}

struct Report {
    Findings findings;
    Json device;  ///< null without one
    int exit_code = kSuccess;

    void add(const Findings& more) { findings.insert(findings.end(), more.begin(), more.end()); }

    /// Add the findings of a check, or its failure as one.
    void add(const char* name, const std::function<Findings()>& check_it) {
        try {
            add(check_it());
        } catch (const Failure& failure) {
            findings.push_back({name, State::kError, failure.what(),
                                "see the message; 'vkrun -v doctor' shows more messages"});
        }
    }

    [[nodiscard]] std::size_t count(State state) const {
        std::size_t found = 0;
        for (const Finding& finding : findings)
            if (finding.state == state) ++found;
        return found;
    }

    [[nodiscard]] State state() const {
        return count(State::kError) > 0     ? State::kError
               : count(State::kWarning) > 0 ? State::kWarning
                                            : State::kOk;
    }
};

std::string choice_words(const std::string& wish, const splat_device_info& info,
                         std::size_t device_count) {
    std::string why = wish != "best" ? "named by --device " + wish
                      : device_count == 1
                          ? "the only one"
                          : "the first of the best kind: discrete before integrated, virtual, cpu";
    return format("device %u, %s, opens; it is ", info.index, info.name) + why;
}

/// What to do if no device opens.
std::string remedy_for(const Failure& failure) {
    for (const char* name : {"SPLAT_KERNELS", "SPLAT_MAX_SUBMIT_MS", "SPLAT_SELF_TEST",
                             "SPLAT_TIMEOUT_SCALE", "SPLAT_VALIDATION"})
        if (variable(name) && std::string(failure.what()).find(name) != std::string::npos)
            return std::string("unset ") + name + ", or do what the sentence says";
    if (failure.code() == kNoDevice) return "choose one that 'vkrun devices' lists as usable";
    return "update the driver, or choose another device (--device)";
}

/// The checks that need an open device.
void examine_device(Report& report, const DoctorOptions& options,
                    const std::vector<splat_device_info>& devices) {
    const splat_device_desc desc = device_desc(options.device);
    Device device;
    splat_device_info info{};
    try {
        device = open_device(desc);
        info = info_of(device.get());
    } catch (const Failure& failure) {
        report.add({{"device", State::kError, failure.what(), remedy_for(failure)}});
        report.exit_code = failure.code();
        return;
    }
    report.device = device_json(info);
    report.add({{"device", State::kOk, choice_words(options.device, info, devices.size()), ""}});
    report.add(check_limits(info));
    report.add("kernels", [&] { return check_kernels(info, devices.at(info.index)); });
    report.add("memory", [&] { return check_memory(device.get(), info); });
    if (options.quick) return;
    report.add("validation", [&] { return check_validation(desc); });
    report.add("tensor", [&] { return check_tensors(device.get()); });
    report.add("operators", [&] { return check_operators(desc); });
}

Report examine(const DoctorOptions& options) {
    Report report;
    report.add(check_library());
    report.add(check_loader());
    std::vector<splat_device_info> devices;
    std::string problem;
    try {
        devices = all_devices();
    } catch (const Failure& failure) {
        problem = failure.what();
        report.exit_code = kNoDevice;  // whatever the reason
    }
    report.add(check_drivers(best_device(devices).has_value()));
    if (problem.empty())
        report.add(check_devices(devices));
    else
        report.add({{"devices", State::kError, problem,
                     "the loader and driver findings above say what is missing"}});
    report.add(check_gpu_nodes(devices));
    report.add(check_environment());
    report.add(check_cache_folder());
    if (problem.empty()) {
        if (!best_device(devices)) report.exit_code = kNoDevice;
        if (!devices.empty()) examine_device(report, options, devices);
    }
    if (report.exit_code == kSuccess && report.count(State::kError) > 0) report.exit_code = kFailed;
    return report;
}

Json report_json(const Report& report) {
    Json document;
    document["library"] = splat_version_string();
    document["state"] = state_name(report.state());
    document["exit_status"] = report.exit_code;
    document["device"] = report.device;
    document["findings"] = Json::array();
    for (const Finding& finding : report.findings) {
        Json one;
        one["check"] = finding.check;
        one["state"] = state_name(finding.state);
        one["sentence"] = finding.sentence;
        one["remedy"] = finding.remedy;
        document["findings"].push_back(std::move(one));
    }
    return document;
}

void print_text(const Report& report) {
    std::size_t width = 0;
    for (const Finding& finding : report.findings) width = std::max(width, finding.check.size());
    const int columns = static_cast<int>(width);
    for (const Finding& finding : report.findings) {
        std::printf("%-7s  %-*s  %s\n", state_name(finding.state), columns, finding.check.c_str(),
                    finding.sentence.c_str());
        if (!finding.remedy.empty())
            std::printf("%-7s  %-*s  -> %s\n", "", columns, "", finding.remedy.c_str());
    }
    std::printf("\n%zu findings: %zu ok, warnings: %zu, errors: %zu\n", report.findings.size(),
                report.count(State::kOk), report.count(State::kWarning),
                report.count(State::kError));
}

int run_doctor(const DoctorOptions& options) {
    const Report report = examine(options);
    if (options.json)
        print_json(report_json(report));
    else
        print_text(report);
    return report.exit_code;
}

}  // namespace

void add_doctor(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "doctor", "Find what keeps libsplat from working here, and how to fix it.",
                    kDoctorFooter);
    const auto options = std::make_shared<DoctorOptions>();
    add_device_option(*command, options->device);
    command->add_flag("--quick", options->quick,
                      "Skip the validation layer and the self-test, which\ncompile shaders");
    add_json_flag(*command, options->json);
    command->callback([options, &exit_code] { exit_code = run_doctor(*options); });
}

}  // namespace vkrun
