#include "vkrun/cli/device.h"

#include <CLI/CLI.hpp>
#include <algorithm>

#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

struct Kind {
    splat_device_kind kind;
    const char* name;
};
constexpr Kind kDeviceKinds[] = {
    {SPLAT_DEVICE_KIND_DISCRETE, "discrete"}, {SPLAT_DEVICE_KIND_INTEGRATED, "integrated"},
    {SPLAT_DEVICE_KIND_VIRTUAL, "virtual"},   {SPLAT_DEVICE_KIND_CPU, "cpu"},
    {SPLAT_DEVICE_KIND_OTHER, "other"},
};

constexpr const char* kDeviceHelp =
    "Device to use: best (discrete before integrated,\n"
    "virtual, cpu), one of these kinds, or an index or UUID\n"
    "from 'vkrun devices --json'";

bool parse_uuid(std::string text, std::uint8_t (&uuid)[16]) {
    text.erase(std::remove(text.begin(), text.end(), '-'), text.end());
    if (text.size() != 32) return false;
    for (std::size_t i = 0; i < 16; ++i) {
        const std::string pair = text.substr(2 * i, 2);
        if (pair.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) return false;
        uuid[i] = static_cast<std::uint8_t>(std::stoi(pair, nullptr, 16));
    }
    return true;
}

}  // namespace

std::vector<splat_device_info> all_devices() {
    std::uint32_t count = 0;
    check(splat_device_count(&count));
    std::vector<splat_device_info> devices;
    for (std::uint32_t i = 0; i < count; ++i) {
        devices.push_back(sized<splat_device_info>());
        check(splat_device_describe(i, &devices.back()));
    }
    return devices;
}

Device open_device(const splat_device_desc& desc) {
    Device device;
    check(splat_device_create(&desc, device.out()));
    return device;
}

splat_device_info info_of(splat_device device) {
    auto info = sized<splat_device_info>();
    check(splat_device_get_info(device, &info));
    return info;
}

const char* kind_name(splat_device_kind kind) {
    for (const Kind& row : kDeviceKinds)
        if (row.kind == kind) return row.name;
    return "unknown";
}

const char* kernels_name(splat_kernels kernels) {
    switch (kernels) {
        case SPLAT_KERNELS_AUTO:
            return "auto";
        case SPLAT_KERNELS_PLAIN:
            return "plain";
        case SPLAT_KERNELS_CPU:
            return "cpu";
        case SPLAT_KERNELS_GPU:
            return "gpu";
        default:
            return "unknown";
    }
}

std::string vulkan_version_text(std::uint32_t version) {
    return format("%u.%u.%u", (version >> 22) & 0x7FU, (version >> 12) & 0x3FFU, version & 0xFFFU);
}

std::vector<std::string> feature_names(std::uint32_t features) {
    std::vector<std::string> names;
    const auto add = [&](std::uint32_t bit, const char* name) {
        if ((features & bit) != 0) names.emplace_back(name);
    };
    add(SPLAT_FEATURE_TIMESTAMPS, "timestamps");
    add(SPLAT_FEATURE_SUBGROUP_SHUFFLE, "subgroup_shuffle");
    add(SPLAT_FEATURE_SUBGROUP_ARITHMETIC, "subgroup_arithmetic");
    add(SPLAT_FEATURE_INT64, "int64");
    add(SPLAT_FEATURE_UNIFIED_MEMORY, "unified_memory");
    add(SPLAT_FEATURE_EXTERNAL_MEMORY, "external_memory");
    return names;
}

Json device_json(const splat_device_info& info) {
    std::string uuid;
    for (const std::uint8_t byte : info.uuid) uuid += format("%02x", byte);
    Json json;
    json["index"] = info.index;
    json["kind"] = kind_name(info.kind);
    json["name"] = info.name;
    json["driver"] = info.driver;
    json["vulkan"] = vulkan_version_text(info.vulkan_version);
    json["vendor_id"] = format("0x%04x", info.vendor_id);
    json["device_id"] = format("0x%04x", info.device_id);
    json["driver_version"] = info.driver_version;
    json["uuid"] = uuid;
    json["usable"] = info.usable != 0;
    json["reason"] = info.reason;
    json["kernels"] = kernels_name(info.kernels);
    json["kernels_note"] = info.kernels_note;
    json["heap_bytes"] = info.heap_bytes;
    json["max_allocation_bytes"] = info.max_allocation_bytes;
    json["max_storage_buffer_bytes"] = info.max_storage_buffer_bytes;
    json["max_workgroup_invocations"] = info.max_workgroup_invocations;
    json["shared_memory_bytes"] = info.shared_memory_bytes;
    json["subgroup_size"] = info.subgroup_size;
    json["features"] = feature_names(info.features);
    return json;
}

std::string device_sentence(const splat_device_info& info) {
    return format("device %u: %s (%s, %s); libsplat %s", info.index, info.name,
                  kind_name(info.kind), info.driver, splat_version_string());
}

std::optional<std::size_t> best_device(const std::vector<splat_device_info>& devices) {
    std::optional<std::size_t> best;  // a usable one with a reason is not the best
    for (std::size_t i = 0; i < devices.size(); ++i)
        if (devices[i].usable != 0 && devices[i].reason[0] == '\0' &&
            (!best || devices[i].kind > devices[*best].kind))
            best = i;
    return best;
}

bool parse_device(const std::string& text, splat_device_desc& desc) {
    if (text == "best") {
        desc.select = SPLAT_SELECT_BEST;
        return true;
    }
    for (const Kind& row : kDeviceKinds)
        if (text == row.name) {
            desc.select = SPLAT_SELECT_BY_KIND;
            desc.kind = row.kind;
            return true;
        }
    if (!text.empty() && text.size() <= 4 &&
        text.find_first_not_of("0123456789") == std::string::npos) {
        desc.select = SPLAT_SELECT_BY_INDEX;
        desc.index = static_cast<std::uint32_t>(std::stoul(text));
        return true;
    }
    desc.select = SPLAT_SELECT_BY_UUID;
    return parse_uuid(text, desc.uuid);
}

void add_device_option(CLI::App& app, std::string& text) {
    app.add_option("--device", text, kDeviceHelp)
        ->type_name("DEVICE")
        ->default_str("best")
        ->check(any_like({"best", "discrete", "integrated", "virtual", "cpu", "other"}))
        ->check(CLI::Validator(
            [](const std::string& value) -> std::string {
                auto desc = sized<splat_device_desc>();
                if (parse_device(value, desc)) return {};
                return "'" + value +
                       "' is not a device; expected best, an index, discrete, integrated, virtual, "
                       "cpu, other, or a UUID of 32 hexadecimal digits";
            },
            ""));
}

splat_device_desc device_desc(const std::string& text) {
    auto desc = sized<splat_device_desc>();
    parse_device(text, desc);
    return desc;
}

}  // namespace vkrun
