#include "config/effects.h"

#include <algorithm>

#include "config/category.h"
#include "config/config_file.h"
#include "config/key_field.h"
#include "config/stages.h"

namespace splat::config {
namespace {

/// True if a value asks for something.
bool asks(const ConfigEntry* entry) {
    if (entry == nullptr || entry->map) return false;
    if (entry->list) return !entry->values.empty();
    const ConfigScalar& value = entry->values[0];
    if (const auto* flag = std::get_if<bool>(&value)) return *flag;
    if (const auto* whole = std::get_if<std::int64_t>(&value)) return *whole != 0;
    if (const auto* number = std::get_if<double>(&value)) return *number != 0;
    if (const auto* text = std::get_if<std::string>(&value)) return !text->empty();
    return false;
}

/// Why a key with this value has no effect; empty if it has one, or asks for nothing.
std::string effect_lacks(const Key& key, const ConfigEntry* entry, const Settings& settings) {
    if (!asks(entry) || key.harmless) return "";
    const bool one_device =
        key.name == std::string_view("general.num_devices") && config_value_text(*entry) == "1";
    if (!key.acts) return one_device ? "" : std::string("here: ") + key.about;
    const bool replaced = all_stages_replace(key, settings.training);
    if (!replaced && (key.where == nullptr || key.where->holds(settings))) return "";
    // Written configurations have every value, except those of adapters.
    const bool default_value =
        key.field.part != Part::kAdapters && same_value(*entry, key.field.write(key, Settings()));
    if (default_value) return "";
    return replaced ? "because every stage of opt.stages has its own" : key.where->otherwise;
}

Status refuse_hub(const Config& config) {
    const ConfigEntry* entry = config.find("opt.pretrained_hf");
    if (!asks(entry)) return {};
    SPLAT_ASSIGN(const std::string category, config.get<std::string>("data.category", "cars"));
    const bool latest = category == "objaverse" || category == "gso";
    return invalid(
        "%s: 'opt.pretrained_hf' is %s, but libsplat fetches nothing: download model_%s.pth "
        "of the hub's szymanowiczs/splatter-image-v1 and name the file in "
        "opt.pretrained_ckpt",
        config.what().c_str(), config_value_text(*entry).c_str(),
        latest ? "latest" : category.c_str());
}

/// Published files name the rank beside "lora_finetune: false"; without that key the adapters are meant.
Status refuse_lone_adapters(const Config& config) {
    if (config.find("opt.lora_finetune") != nullptr) return {};
    for (const Key& key : all_keys()) {
        const ConfigEntry* entry = config.find(key.name);
        if (key.field.part != Part::kAdapters || !asks(entry)) continue;
        return invalid(
            "%s: '%s' is %s, but without opt.lora_finetune there are no adapters: set "
            "opt.lora_finetune to true, or to false to train all parameters",
            config.what().c_str(), key.name, config_value_text(*entry).c_str());
    }
    return {};
}

/// A training reads the vectors of its views from a file.
Status refuse_missing_vectors(const Config& config, const Settings& settings) {
    const auto refuse = [&](const char* key, const char* asked_by) {
        return invalid("%s: '%s' is empty, expected the file of the vectors that '%s' asks for",
                       config.what().c_str(), key, asked_by);
    };
    if (settings.network.embedding == Embedding::kCustom &&
        settings.training.embedding_file.empty())
        return refuse("data.embedding_file", "data.custom_embedding");
    if (settings.network.token_dim > 0 && settings.training.tokens_file.empty())
        return refuse("data.tokens_file", "model.tokens");
    return {};
}

bool contains_any(const std::string& name, const std::vector<std::string>& parts) {
    return std::any_of(parts.begin(), parts.end(), [&](const std::string& part) {
        return name.find(part) != std::string::npos;
    });
}

/// New input channels start without influence, through zeros in the first convolution.
void warn_of_frozen_channels(const ModelConfig& c, std::vector<std::string>& warnings) {
    if (!c.depth && !c.normal && !c.mask && !c.plane) return;
    const std::string layer = format("%s.encoder.enc.%ux%u_conv", c.network_name(),
                                     c.names_resolution(), c.names_resolution());
    const std::string weight = layer + ".weight";
    const auto learns = [&](const std::string& parameter) {
        return !contains_any(parameter, c.frozen);
    };
    const bool chosen = c.lora.rank == 0 || contains_any(weight, c.lora.trained);
    const bool adapted = c.lora.rank > 0 && contains_any(layer, c.lora.targets);
    if ((chosen && learns(weight)) || (adapted && learns(layer + ".lora_A"))) return;
    warnings.push_back(
        format("'%s' is not trained, so channels of depth, normals, mask or planes that are "
               "grafted onto it stay without influence: %s",
               weight.c_str(),
               chosen || adapted ? "take it out of opt.freeze"
                                 : "name it in opt.train_with_adapters, or in opt.lora_targets"));
}

/// Without their lists, these data sets are not those of the published models.
void warn_of_missing_lists(const Config& config, const TrainConfig& c,
                           std::vector<std::string>& warnings) {
    if (is_co3d_category(c.category) && c.excluded_file.empty())
        warnings.push_back(config.what() +
                           ": 'data.excluded_file' is empty, so no sequence is left out; the "
                           "published models leave "
                           "out those of bad_sequences.py of Splatter Image");
    if (c.category == "objaverse" && c.objects_file.empty())
        warnings.push_back(
            config.what() +
            ": 'data.objects_file' is empty, so all folders are objects; the published model is "
            "trained on a list of LVIS's");
}

}  // namespace

Result<std::vector<std::string>> training_warnings(const Config& config, VectorsFrom vectors) {
    SPLAT_ASSIGN(const Settings settings, settings_of(config));
    SPLAT_TRY(refuse_hub(config));
    SPLAT_TRY(refuse_lone_adapters(config));
    if (vectors == VectorsFrom::kFiles) SPLAT_TRY(refuse_missing_vectors(config, settings));
    std::vector<std::string> warnings;
    for (const Key& key : all_keys()) {
        const std::string lacks = effect_lacks(key, config.find(key.name), settings);
        if (!lacks.empty())
            warnings.push_back(format("%s: '%s' has no effect %s", config.what().c_str(), key.name,
                                      lacks.c_str()));
    }
    warn_of_frozen_channels(settings.network, warnings);
    warn_of_missing_lists(config, settings.training, warnings);
    return warnings;
}

std::string value_text(const Config& config, const std::string& key) {
    const Key* known = find_key(key);
    if (known != nullptr && known->field.type == KeyType::kMaps) return stages_text(config);
    if (const ConfigEntry* entry = config.find(key)) return config_value_text(*entry);
    if (known == nullptr || known->field.write == nullptr) return "";
    return config_value_text(known->field.write(*known, Settings()));
}

std::vector<std::string> changed_keys(const Config& run, const Config& given) {
    std::vector<std::string> changed;
    for (const Key& key : all_keys())
        if (value_text(run, key.name) != value_text(given, key.name))
            changed.emplace_back(key.name);
    return changed;
}

bool may_change_on_resume(std::string_view name) {
    const Key* key = find_key(name);
    return key != nullptr && key->resumable;
}

}  // namespace splat::config
