#pragma once

#include <splat.h>

#include <optional>
#include <string>
#include <vector>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"

namespace CLI {
class App;
}

namespace vkrun {

/// Every device of this machine, usable or not. Throws without a loader or a driver.
std::vector<splat_device_info> all_devices();

Device open_device(const splat_device_desc& desc);
splat_device_info info_of(splat_device device);

const char* kind_name(splat_device_kind kind);
const char* kernels_name(splat_kernels kernels);
std::string vulkan_version_text(std::uint32_t version);
std::vector<std::string> feature_names(std::uint32_t features);
Json device_json(const splat_device_info& info);

/// The first line of a report: "device 0: NAME (KIND, DRIVER); libsplat VERSION".
std::string device_sentence(const splat_device_info& info);

/// The position of the device that SPLAT_SELECT_BEST opens.
std::optional<std::size_t> best_device(const std::vector<splat_device_info>& devices);

/// Parse a value of --device: "best", an index, a kind or a UUID. False if `text` is none of these.
bool parse_device(const std::string& text, splat_device_desc& desc);

/// Add --device; its value, once checked, goes to `text`.
void add_device_option(CLI::App& app, std::string& text);

/// A description of the device that a checked --device names.
splat_device_desc device_desc(const std::string& text);

}  // namespace vkrun
