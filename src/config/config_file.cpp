#include "config/config_file.h"

#include <algorithm>

#include "config/category.h"
#include "config/key_field.h"
#include "config/stages.h"
#include "core/json_writer.h"
#include "core/shown.h"

namespace splat::config {
namespace {

/// Sections of published files that are for other programs.
constexpr const char* kForeignSections[] = {"hydra", "wandb", "defaults"};

/// "opt" of "opt.ema.beta", and the rest.
std::string section_of(const Key& key) {
    const std::string name = key.name;
    return name.substr(0, name.find('.'));
}

std::string member_of(const Key& key) {
    return key.name + section_of(key).size() + 1;
}

/// The keys of a part, except those that a rule reads.
Status read_part(const Config& config, Part part, Settings& settings) {
    for (const Key& key : all_keys())
        if (key.field.part == part && key.field.read != nullptr)
            SPLAT_TRY(key.field.read(config, key, settings));
    return {};
}

bool is_given(const Config& config, const char* key) {
    const ConfigEntry* entry = config.find(key);
    return entry != nullptr && !entry->map &&
           (entry->list || !std::holds_alternative<std::monostate>(entry->values[0]));
}

constexpr const char* kHeadWord = "model.head";
constexpr const char* kHeadLike = "model.head.like";

/// Keys whose values a head implies.
bool is_of_head(const Key& key) {
    constexpr std::string_view kNames[] = {
        "model.max_sh_degree", "model.isotropic", "model.depth_scale",   "model.depth_bias",
        "model.xyz_scale",     "model.xyz_bias",  "model.opacity_scale", "model.opacity_bias",
        "model.scale_scale",   "model.scale_bias"};
    return std::string_view(key.name).starts_with("model.head.") ||
           std::ranges::find(kNames, std::string_view(key.name)) != std::end(kNames);
}

/// Take over the row of a head; call it before the keys are read.
Status read_head(const Config& config, std::span<const Head> heads, ModelConfig& c) {
    const char* const key = is_given(config, kHeadWord) ? kHeadWord : kHeadLike;
    SPLAT_ASSIGN(const std::string name, config.get<std::string>(key, heads[0].name));
    const auto found =
        std::ranges::find_if(heads, [&](const Head& head) { return name == head.name; });
    if (found == heads.end())
        return invalid("%s: '%s' is '%s', expected one of %s", config.what().c_str(), key,
                       shown(name).c_str(),
                       joined(std::vector(heads.begin(), heads.end()), [](const Head& head) {
                           return std::string(head.name);
                       }).c_str());
    take_head(*found, c);
    return {};
}

Result<std::string> category_of(const Config& config) {
    return config.get<std::string>("data.category", "");
}

/// Hold CO3D's geometry, which the published code infers from the category. Call it after the keys are
/// read. Merged files of that code hold the field of view of the default configuration, which it ignores.
Status check_category(const Config& config, ModelConfig& c) {
    SPLAT_ASSIGN(const std::string category, category_of(config));
    if (!is_co3d_category(category)) return {};
    if (c.fov_degrees != 0 && c.fov_degrees != ModelConfig().fov_degrees)
        return invalid(
            "%s: 'data.fov' is %g, but 'data.category' is '%s', whose views have focal "
            "lengths of their own; expected 0, or no data.fov",
            config.what().c_str(), static_cast<double>(c.fov_degrees), category.c_str());
    if (is_given(config, "data.origin_distances") && !c.origin_distance)
        return invalid(
            "%s: 'data.origin_distances' is false, but 'data.category' is '%s', whose "
            "depths are relative to them; expected true, or no data.origin_distances",
            config.what().c_str(), category.c_str());
    c.fov_degrees = 0;
    c.origin_distance = true;
    return {};
}

Status refuse_text(const Config& config, const char* key, const std::string& value,
                   const char* expected) {
    return invalid("%s: '%s' is %s, expected %s", config.what().c_str(), key, value.c_str(),
                   expected);
}

/// The published code asserts that an embedding enters by FiLM. It has no layer for embeddings that are not
/// made of sines and cosines, except the caller's own.
Status check_embedding(const Config& config, const ModelConfig& c) {
    const auto is_null = [&](const char* key) {
        return config.find(key) != nullptr && !is_given(config, key);
    };
    SPLAT_ASSIGN(const bool custom, config.get<bool>("data.custom_embedding", false));
    if (custom && c.embedding == Embedding::kNone)
        return refuse_text(
            config, "cam_embd.embedding", "none",
            "pose where data.custom_embedding is true, whose vectors take its place");
    if (c.embedding == Embedding::kNone) return {};
    SPLAT_ASSIGN(const std::string method, config.get<std::string>("cam_embd.method", "film"));
    if (method != "film" || is_null("cam_embd.method"))
        return refuse_text(config, "cam_embd.method", is_null("cam_embd.method") ? "null" : method,
                           "film where there is an embedding");
    if (custom) return {};
    SPLAT_ASSIGN(const std::string encode,
                 config.get<std::string>("cam_embd.encode_embedding", "positional"));
    if (encode != "positional" || is_null("cam_embd.encode_embedding"))
        return refuse_text(config, "cam_embd.encode_embedding",
                           is_null("cam_embd.encode_embedding") ? "null" : encode,
                           "positional where there is an embedding");
    return {};
}

/// Require one of the two networks; the published code would build both or neither.
Status read_offset(const Config& config, ModelConfig& c) {
    constexpr const char* kWith = "model.network_with_offset";
    constexpr const char* kWithout = "model.network_without_offset";
    SPLAT_ASSIGN(const bool without, config.get<bool>(kWithout, !c.offset));
    SPLAT_ASSIGN(c.offset, config.get<bool>(kWith, !without));
    if (is_given(config, kWith) && is_given(config, kWithout) && c.offset == without)
        return invalid("%s: '%s' and '%s' are both %s, expected one of them", config.what().c_str(),
                       kWith, kWithout, without ? "true" : "false");
    return {};
}

Status read_embedding(const Config& config, ModelConfig& c) {
    int kind = 0;
    SPLAT_TRY(read_word(config, key_of("cam_embd.embedding"), kind));
    bool custom = false;
    SPLAT_TRY(read_field(config, key_of("data.custom_embedding"), custom));
    if (kind == 0)
        c.embedding_dim = ModelConfig().embedding_dim;
    else
        c.embedding = custom ? Embedding::kCustom : static_cast<Embedding>(kind);
    return {};
}

Status read_adapters(const Config& config, Settings& settings) {
    bool finetune = false;
    SPLAT_TRY(read_field(config, key_of("opt.lora_finetune"), finetune));
    if (!finetune) return {};
    std::uint32_t& rank = settings.network.lora.rank;
    rank = kPublishedRank;
    SPLAT_TRY(read_part(config, Part::kAdapters, settings));
    if (rank > 0) return {};
    return invalid(
        "%s: 'opt.lora_rank' is 0, expected 1 or more with opt.lora_finetune; to train "
        "all parameters, set opt.lora_finetune to false",
        config.what().c_str());
}

Status check_training(const TrainConfig& c, const char* what) {
    const auto wrong = [what](const char* key, std::uint64_t value, const std::string& expected) {
        return invalid("%s: '%s' is %llu, expected %s", what, key, llu(value), expected.c_str());
    };
    if (c.batch_size % c.micro_batch != 0)
        return wrong("opt.micro_batch", c.micro_batch,
                     format("a divisor of opt.batch_size, %u", c.batch_size));
    if (c.ema && c.ema_every == 0) return wrong("opt.ema.update_every", 0, "at least 1");
    double sum = 0;
    std::string keys, weights;
    for (const LossTerm& term : kLossTerms) {
        if (!term.replaces) continue;
        sum += c.*term.weight;
        const char* const joint = keys.empty() ? "" : " and ";
        keys += joint + format("'%s'", term.key);
        weights += joint + format("%g", c.*term.weight);
    }
    if (sum > 1)
        return invalid("%s: %s are %s, expected a sum of at most 1", what, keys.c_str(),
                       weights.c_str());
    return {};
}

Status check_targets(const TrainConfig& c, std::uint32_t resolution, const std::string& what) {
    for (std::size_t i = 0; i < c.stages.size(); ++i)
        SPLAT_TRY(check_targets(c.stages[i], resolution, stage_name(what, i)));
    const std::uint32_t side = c.target_resolution;
    if (side == 0 || resolution % side == 0) return {};
    return invalid(
        "%s: 'opt.target_resolution' is %u, expected a divisor of "
        "data.training_resolution, %u",
        what.c_str(), side, resolution);
}

/// Let go of those values of the configuration that `implied` has, too.
void forget(const Config& base, const char* name, const Settings& implied, Config& changed) {
    const Key& key = key_of(name);
    const ConfigEntry* entry = base.find(name);
    if (entry != nullptr && !entry->map && same_value(*entry, key.field.write(key, implied)))
        changed.set({name, {ConfigScalar()}, false, false});
}

/// Where the changes name another category or head, let go of the values that only say what the old one implied, so
/// that those of the new one hold.
Status forget_implied(const Config& base, const Config& changes, Config& changed) {
    changed = without_stages(base, changes);
    Settings implied;
    if (is_given(changes, "data.category")) {
        SPLAT_ASSIGN(const std::string category, category_of(base));
        take_category_defaults(category, implied);
        for (const char* name : category_keys()) forget(base, name, implied, changed);
    }
    if (!is_given(changes, kHeadWord) && !is_given(changes, kHeadLike)) return {};
    SPLAT_TRY(read_head(base, kHeads, implied.network));
    for (const Key& key : all_keys())
        if (is_of_head(key) && key.field.write != nullptr) forget(base, key.name, implied, changed);
    const ConfigEntry* const word = base.find(kHeadWord);
    if (word != nullptr && !word->map) changed.set({kHeadWord, {ConfigScalar()}, false, false});
    return {};
}

/// The network itself is written only if it is not the one of all configurations before it, the keys of the other one
/// only with it.
bool is_written_with(Network network, const Key& key) {
    constexpr std::string_view kOfLgm[] = {"model.network", "model.down", "model.down_attention",
                                           "model.up", "model.up_attention"};
    return network == Network::kLgmUnet ||
           std::ranges::find(kOfLgm, std::string_view(key.name)) == std::end(kOfLgm);
}

/// Keys that configurations without model.head never had are written only if one of them has another value.
bool is_default_head(const ModelConfig& network) {
    return std::ranges::none_of(all_keys(), [&](const Key& key) {
        return std::string_view(key.name).starts_with("model.head.") &&
               !same_value(key.field.write(key, {network, {}}), key.field.write(key, Settings()));
    });
}

/// Keys of adapters are written only if there are adapters, opt.freeze also if it is not empty.
bool is_written(const Key& key, const Settings& settings) {
    const ModelConfig& network = settings.network;
    if (key.field.write == nullptr || !is_written_with(network.network, key)) return false;
    if (std::string_view(key.name).starts_with("opt.cycle."))
        return settings.training.cycle_every > 0;
    if (key.name == std::string_view("opt.stages")) return !settings.training.stages.empty();
    if (key.name == std::string_view("opt.target_resolution"))
        return settings.training.target_resolution != 0;
    if (key.name == std::string_view("model.named_resolution"))
        return network.named_resolution != 0;
    if (std::string_view(key.name).starts_with("model.head.")) return !is_default_head(network);
    const bool adapters = network.lora.rank > 0;
    if (key.name == std::string_view("opt.freeze")) return adapters || !network.frozen.empty();
    return key.field.part != Part::kAdapters || adapters;
}

}  // namespace

Status check_names(const Config& config) {
    std::vector<std::string> names, sections;
    for (const Key& key : all_keys()) {
        names.emplace_back(key.name);
        if (sections.empty() || sections.back() != section_of(key))
            sections.push_back(section_of(key));
    }
    SPLAT_ASSIGN(const std::vector<std::string> of_stages, stage_names(config));
    names.insert(names.end(), of_stages.begin(), of_stages.end());
    std::vector<std::string> known = sections;
    known.insert(known.end(), std::begin(kForeignSections), std::end(kForeignSections));
    SPLAT_TRY(config.refuse_unknown_sections(known));
    return config.refuse_unknown(names, sections);
}

Result<ModelConfig> model_config(const Config& config, std::span<const Head> heads) {
    SPLAT_TRY(check_names(config));
    Settings settings;
    SPLAT_ASSIGN(const std::string category, category_of(config));
    take_category_defaults(category, settings);
    SPLAT_TRY(read_head(config, heads, settings.network));
    SPLAT_TRY(read_part(config, Part::kNetwork, settings));
    ModelConfig& c = settings.network;
    SPLAT_TRY(read_embedding(config, c));
    SPLAT_TRY(read_adapters(config, settings));
    SPLAT_TRY(check_category(config, c));
    SPLAT_TRY(check_embedding(config, c));
    SPLAT_TRY(read_offset(config, c));
    SPLAT_TRY(check(c));
    return c;
}

Result<TrainConfig> train_config(const Config& config) {
    SPLAT_TRY(check_names(config));
    Settings settings;
    TrainConfig& c = settings.training;
    SPLAT_ASSIGN(const std::string category, category_of(config));
    take_category_defaults(category, settings);
    SPLAT_TRY(read_part(config, Part::kTraining, settings));
    SPLAT_TRY(read_stages(config, c));
    SPLAT_TRY(check_training(c, config.what().c_str()));
    for (std::size_t i = 0; i < c.stages.size(); ++i)
        SPLAT_TRY(check_training(c.stages[i], stage_name(config.what(), i).c_str()));
    return c;
}

Result<Settings> settings_of(const Config& config) {
    Settings made;
    SPLAT_ASSIGN(made.network, model_config(config));
    SPLAT_ASSIGN(made.training, train_config(config));
    SPLAT_TRY(check_targets(made.training, made.network.resolution, config.what()));
    return made;
}

Result<Config> with_values(const Config& config, std::span<const std::string> texts) {
    Config changes("changes");
    for (const std::string& text : texts) {
        const std::size_t sign = text.find('=');
        if (sign == std::string::npos || sign == 0)
            return invalid("'%s' is not of the form key=value", text.c_str());
        // A document of one line; the key's dots are part of its name, as in Config.
        SPLAT_ASSIGN(const Config line,
                     read_yaml_config(text.substr(0, sign) + ": " + text.substr(sign + 1),
                                      "'" + text + "'"));
        for (const ConfigEntry& each : line.entries()) changes.set(each);
    }
    Config changed = config;
    SPLAT_TRY(forget_implied(config, changes, changed));
    for (const ConfigEntry& each : changes.entries()) changed.set(each);
    return changed;
}

std::string config_text(const ModelConfig& network) {
    constexpr int kMembersPerLine = 11;
    const Settings settings{network, {}};
    JsonWriter json;
    json.begin_object();
    std::string section;
    int members = 0;
    for (const Key& key : all_keys()) {
        if (key.field.part == Part::kTraining || !is_written(key, settings)) continue;
        if (section_of(key) != section) {
            if (!section.empty()) json.end().newline(1);
            section = section_of(key);
            members = 0;
            json.key(section).begin_object();
        }
        if (members++ == kMembersPerLine) json.newline(2);
        json.key(member_of(key)).raw(config_value_text(key.field.write(key, settings)));
    }
    return json.end().end().text() + "\n";
}

std::string merged_config_text(const Settings& settings) {
    Config merged("configuration");
    for (const Key& key : all_keys()) {
        if (!is_written(key, settings)) continue;
        ConfigEntry entry = key.field.write(key, settings);
        entry.key = key.name;
        merged.set(std::move(entry));
        if (key.field.type != KeyType::kMaps) continue;
        for (ConfigEntry& each : stage_entries(settings.training)) merged.set(std::move(each));
    }
    return config_json(merged);
}

}  // namespace splat::config
