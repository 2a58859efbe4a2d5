#include "train/training_facts.h"

#include "core/hash.h"
#include "core/shown.h"

namespace splat::train {
namespace {

void add_features(JsonWriter& json, const vk::DeviceInfo& info) {
    const std::pair<bool, const char*> features[] = {
        {info.limits.timestamp_ns > 0, "timestamps"},
        {info.features.subgroup_shuffle, "subgroup_shuffle"},
        {info.features.subgroup_arithmetic, "subgroup_arithmetic"},
        {info.features.int64, "int64"},
        {info.features.unified_memory, "unified_memory"}};
    json.begin_array();
    for (const auto& [has, name] : features)
        if (has) json.value(name);
    json.end();
}

void add_device(JsonWriter& json, const vk::Device& device) {
    const vk::DeviceInfo& info = device.info();
    std::string uuid;
    for (const std::uint8_t byte : info.uuid) uuid += format("%02x", byte);
    const std::uint32_t version = info.vulkan_version;
    json.begin_object().member("index", info.index);
    json.member("kind", vk::device_kind_name(info.kind)).member("name", info.name);
    json.member("driver", info.driver);
    json.member("vulkan", format("%u.%u.%u", (version >> 22U) & 0x7FU, (version >> 12U) & 0x3FFU,
                                 version & 0xFFFU));
    json.newline(4).member("vendor_id", format("0x%04x", info.vendor_id));
    json.member("device_id", format("0x%04x", info.device_id));
    json.member("driver_version", info.driver_version).member("uuid", uuid);
    json.member("usable", info.usable()).member("reason", info.reason);
    json.member("kernels", vk::kernels_text(device.all_kernels()));
    json.newline(4).member("heap_bytes", info.limits.heap_bytes);
    json.member("max_allocation_bytes", info.limits.max_allocation_bytes);
    json.member("max_storage_buffer_bytes", info.limits.max_storage_buffer_bytes);
    json.newline(4).member("max_workgroup_invocations", info.limits.max_group_invocations);
    json.member("shared_memory_bytes", info.limits.shared_memory_bytes);
    json.member("subgroup_size", info.limits.subgroup_size).newline(4).key("features");
    add_features(json, info);
    json.end();
}

/// Hash of what steps depend on: names and numbers of views of the objects in order, and the size of images; not of the
/// place or the format of the data.
std::string hash_of(const data::DatasetIndex& index) {
    Hash hash;
    for (std::size_t i = 0; i < index.names.size(); ++i)
        hash.add(format("%zu %s %u\n", index.names[i].size(), index.names[i].c_str(),
                        index.views_of[i]));
    hash.add(std::to_string(index.resolution));
    return hash.text();
}

void add_data(JsonWriter& json, const data::Dataset& dataset) {
    const data::DatasetIndex& index = dataset.index();
    std::uint64_t views = 0;
    for (const std::uint32_t count : index.views_of) views += count;
    json.begin_object().member("format", index.format).member("split", index.split);
    json.member("objects", index.names.size()).member("views", views);
    json.member("resolution", dataset.resolution());
    json.member("stored_resolution", index.resolution);
    json.member("hash", hash_of(index)).key("maps").begin_array();
    for (const data::MapKind kind : data::kMaps)
        if ((index.maps & data::flag_of(kind)) != 0) json.value(data::map_name(kind));
    json.end().end();
}

/// What check_same_data() compares of add_data().
constexpr const char* kDataFacts[] = {"split", "objects", "views", "stored_resolution", "hash"};

constexpr std::pair<const char*, bool model::ImageChannels::*> kStartMaps[] = {
    {"depth", &model::ImageChannels::depth},
    {"normal", &model::ImageChannels::normal},
    {"mask", &model::ImageChannels::mask},
    {"plane", &model::ImageChannels::plane}};

void add_start(JsonWriter& json, const Start& start) {
    if (start.file.empty()) {
        json.raw("null");
        return;
    }
    json.begin_object().member("file", start.file).member("graft", start.options.graft);
    json.member("take_rays", start.options.take_rays).key("maps").begin_array();
    for (const auto& [name, map] : kStartMaps)
        if (start.options.source.*map) json.value(name);
    json.end().end();
}

/// The text or whole number of a value; else empty.
std::string text_of(const JsonTree& value) {
    if (value.text() != nullptr) return *value.text();
    return value.count() ? std::to_string(*value.count()) : "";
}

bool is_true(const JsonTree* value) {
    const bool* const truth = value == nullptr ? nullptr : std::get_if<bool>(&value->value);
    return truth != nullptr && *truth;
}

}  // namespace

run::Numbers ledger_of(const TrainStep& step) {
    return {{"visible", static_cast<double>(step.visible)},
            {"culled", static_cast<double>(step.culled)},
            {"non_finite", static_cast<double>(step.non_finite)},
            {"gradients_zero", step.gradients_zero ? 1.0 : 0.0, true}};
}

std::uint64_t trainable_of(const nn::Parameters& parameters) {
    std::uint64_t trainable = 0;
    for (const nn::Parameter& parameter : parameters.all())
        if (parameter.trainable) trainable += parameter.shape.elements();
    return trainable;
}

void add_facts(JsonWriter& json, const vk::Device& device, std::uint64_t seed,
               const nn::Parameters& parameters, const data::Dataset& dataset, const Start& start) {
    json.newline(2).key("device");
    add_device(json, device);
    json.newline(2).member("seed", seed).newline(2).member("parameters", parameters.elements());
    json.newline(2).member("trainable", trainable_of(parameters)).newline(2).key("data");
    add_data(json, dataset);
    json.newline(2).key("start");
    add_start(json, start);
}

Result<Start> start_of(const JsonTree& run_json, const std::string& path) {
    const JsonTree* const found = run_json.find("start");
    Start start;
    if (found != nullptr && found->is_null()) return start;
    const std::string* const file = run_json["start"]["file"].text();
    const JsonTree::List* const maps = run_json["start"]["maps"].list();
    if (file == nullptr || maps == nullptr)
        return damaged("'%s' does not say what the run was started from", path.c_str());
    start.file = *file;
    start.options.graft = is_true(found->find("graft"));
    start.options.take_rays = is_true(found->find("take_rays"));
    for (const JsonTree& map : *maps)
        for (const auto& [name, member] : kStartMaps)
            if (map.text() != nullptr && *map.text() == name) start.options.source.*member = true;
    return start;
}

void add_facts(std::vector<std::pair<std::string, std::string>>& facts,
               const data::Dataset& dataset) {
    JsonWriter json;
    add_data(json, dataset);
    const auto now = parse_json_tree(json.text(), "data");
    for (const char* name : kDataFacts)
        if (now.ok())
            facts.emplace_back(format("the data's '%s'", name), text_of(now.value()[name]));
}

Result<bool> check_same_data(const JsonTree& run_json, const data::Dataset& dataset) {
    JsonWriter json;
    add_data(json, dataset);
    const auto now = parse_json_tree(json.text(), "data");
    const JsonTree* const before = run_json.find("data");
    if (before == nullptr || !now.ok()) return false;
    for (const char* name : kDataFacts) {
        const JsonTree* const one = before->find(name);
        const std::string was = one == nullptr ? "" : text_of(*one);
        const std::string is = text_of(*now.value().find(name));
        if (was.empty() || was == is) continue;
        if (std::string_view(name) == "hash")
            return invalid(
                "the data is not that of the run that is resumed: its objects have other "
                "names or numbers of views, though there are as many (the first is '%s'), "
                "and every step depends on them; give the run's data by data.root, or "
                "begin a new run",
                shown(dataset.index().names.front()).c_str());
        return invalid(
            "the data is not that of the run that is resumed: '%s' is %s, but %s in "
            "run.json, and every step depends on it; give the run's data by data.root, or "
            "begin a new run",
            name, is.c_str(), was.c_str());
    }
    return before->find("hash") != nullptr;
}

}  // namespace splat::train
