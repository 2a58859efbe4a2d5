#pragma once

#include <splat.h>

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace vkrun {

using Json = nlohmann::ordered_json;  ///< keeps the order in which keys are written

/// The text on one line or indented; bytes that are no UTF-8 (names of drivers) are replaced.
std::string json_text(const Json& json);

const char* kind_name(splat_device_kind kind);
const char* kernels_name(splat_kernels kernels);
std::string vulkan_version_text(std::uint32_t version);
std::vector<std::string> feature_names(std::uint32_t features);
Json device_json(const splat_device_info& info);

/// Position of what SPLAT_SELECT_BEST opens.
std::optional<std::size_t> best_device(const std::vector<splat_device_info>& devices);

/// What --device takes: "best", an index, a kind or a UUID. False if `text` is none of these.
bool parse_device(const std::string& text, splat_device_desc& desc);

/// The option --device, checked, its value left in `text`.
void add_device_option(CLI::App& app, std::string& text);

/// A description of the device that a checked --device names.
splat_device_desc device_desc(const std::string& text);

}  // namespace vkrun
