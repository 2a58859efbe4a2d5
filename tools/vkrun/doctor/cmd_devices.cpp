// vkrun devices: what Vulkan offers on this machine.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <optional>

#include "vkrun/cli/command.h"
#include "vkrun/cli/device.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/table.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr const char* kDevicesFooter =
    R"(A device that libsplat cannot use, or only if it is named, is listed with the reason. '*' marks
the one that is opened by default. 'kernels' names the shaders that run networks on the device:
plain ones on any device, cpu or gpu ones on a device with subgroups of 8 or more lanes. A line below
the table says where others sort and blend, and which ones failed their test here.

Exit status: 0 there is a usable device, 1 other failures, 2 wrong usage, 3 no usable device.

Examples:
  vkrun devices
  vkrun devices --json | jq '.devices[].name'
)";

void print_table(const std::vector<splat_device_info>& devices, std::optional<std::size_t> best) {
    Table table({"", ">index", "kind", "name", "driver", "Vulkan", ">memory", "kernels", "usable"});
    for (const splat_device_info& info : devices)
        table.add({best && devices[*best].index == info.index ? "*" : "", format("%u", info.index),
                   kind_name(info.kind), info.name, info.driver,
                   vulkan_version_text(info.vulkan_version), bytes_text(info.heap_bytes),
                   kernels_name(info.kernels),
                   (info.usable == 0         ? "no: "
                    : info.reason[0] != '\0' ? "yes, if named: "
                                             : "yes") +
                       std::string(info.reason)});
    std::fputs(table.text().c_str(), stdout);
    for (const splat_device_info& info : devices)
        if (info.kernels_note[0] != '\0')
            std::printf("device %u: %s\n", info.index, info.kernels_note);
}

Json to_json(const std::vector<splat_device_info>& devices, std::optional<std::size_t> best) {
    Json list = Json::array();
    for (const splat_device_info& info : devices) {
        Json one = device_json(info);
        one["default"] = best && devices[*best].index == info.index;
        list.push_back(std::move(one));
    }
    Json json;
    json["library"] = splat_version_string();
    json["devices"] = std::move(list);
    return json;
}

int run_devices(bool json) {
    std::vector<splat_device_info> devices;
    std::string problem;
    int exit_code = kSuccess;
    try {
        devices = all_devices();
    } catch (const Failure& failure) {
        problem = failure.what();
        exit_code = failure.code();
    }
    const auto best = best_device(devices);
    if (exit_code == kSuccess && !best) {
        exit_code = kNoDevice;
        problem = devices.empty()
                      ? "Vulkan drivers are installed, but none of them has a device here; Mesa's "
                        "mesa-vulkan-drivers (Debian, Ubuntu, Fedora) gives a software one"
                      : "none of the devices can be used; the reasons are listed";
    }
    if (json) {
        Json document = to_json(devices, best);
        if (!problem.empty()) document["error"] = problem;
        print_json(document);
    } else if (!devices.empty()) {
        print_table(devices, best);
    }
    if (!problem.empty())
        std::fprintf(stderr, "vkrun: %s\n       'vkrun doctor' says why\n", problem.c_str());
    return exit_code;
}

}  // namespace

void add_devices(CLI::App& app, int& exit_code) {
    CLI::App* command =
        add_command(app, "devices", "List the Vulkan devices of this machine.", kDevicesFooter);
    const auto json = std::make_shared<bool>(false);
    add_json_flag(*command, *json);
    command->callback([json, &exit_code] { exit_code = run_devices(*json); });
}

}  // namespace vkrun
