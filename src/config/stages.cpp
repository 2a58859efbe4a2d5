#include "config/stages.h"

#include <algorithm>

#include "config/key_field.h"
#include "core/shown.h"

namespace splat::config {
namespace {

constexpr const char* kList = "opt.stages";
constexpr const char* kSum = "opt.iterations";

/// Keys of a stage that are no weights of terms of the loss.
constexpr const char* kOfStage[] = {kSum, "opt.batch_size", "opt.base_lr", "opt.loss",
                                    "opt.target_resolution"};

std::vector<const Key*> keys_of_stage() {
    std::vector<const Key*> keys;
    for (const char* name : kOfStage) keys.push_back(&key_of(name));
    for (const LossTerm& term : kLossTerms) keys.push_back(&key_of(term.key));
    return keys;
}

/// "opt.stages.0.base_lr"
std::string name_in(std::size_t stage, const Key& key) {
    return format("%s.%zu.%s", kList, stage, key.name + std::string_view("opt.").size());
}

bool has_stage(const Config& config, std::size_t number) {
    const std::string stage = format("%s.%zu", kList, number), below = stage + ".";
    return std::ranges::any_of(config.entries(), [&](const ConfigEntry& entry) {
        return entry.key == stage || entry.key.starts_with(below);
    });
}

std::size_t stages_in(const Config& config) {
    std::size_t count = 0;
    while (count < kMostStages && has_stage(config, count)) ++count;
    return count;
}

Status check_list(const Config& config) {
    const ConfigEntry* const list = config.find(kList);
    const bool null = list != nullptr && !list->list && !list->map && list->values[0].index() == 0;
    if (list == nullptr || list->map || null || (list->list && list->values.empty())) return {};
    return invalid(
        "%s: '%s' is %s, expected a list of maps, such as [{iterations: 8000, base_lr: 1e-4}]",
        config.what().c_str(), kList, shown(config_value_text(*list)).c_str());
}

/// The values of a stage under the names that they have outside of it.
Config values_of(const Config& config, std::size_t stage) {
    Config values(stage_name(config.what(), stage));
    for (const Key* const key : keys_of_stage())
        if (const ConfigEntry* const given = config.find(name_in(stage, *key))) {
            ConfigEntry entry = *given;
            entry.key = key->name;
            values.set(std::move(entry));
        }
    return values;
}

Result<TrainConfig> read_stage(const Config& values, const TrainConfig& base) {
    const ConfigEntry* const updates = values.find(kSum);
    Settings settings;
    settings.training = base;
    settings.training.iterations = 0;
    for (const Key* const key : keys_of_stage()) SPLAT_TRY(key->field.read(values, *key, settings));
    if (settings.training.iterations > 0) return std::move(settings.training);
    return invalid("%s has %s, expected 1 or more", values.what().c_str(),
                   updates == nullptr ? "no 'iterations'" : "0 iterations");
}

/// What stages cannot be given beside.
Status check_beside(const Config& config, const TrainConfig& c, std::uint64_t sum) {
    const char* const what = config.what().c_str();
    if (c.lpips_after > 0)
        return invalid(
            "%s: both '%s' and 'opt.start_lpips_after' are given, which say when LPIPS takes "
            "part; give lambda_lpips in the stages alone",
            what, kList);
    SPLAT_ASSIGN(const std::int64_t given, config.get<std::int64_t>(kSum, -1));
    if (given >= 0 && static_cast<std::uint64_t>(given) != sum)
        return invalid(
            "%s: '%s' is %lld, but the stages of '%s' have %llu updates in all; leave '%s' out, or "
            "give the stages other iterations",
            what, kSum, static_cast<long long>(given), kList, llu(sum), kSum);
    for (std::size_t i = 0; c.schedule == Schedule::kStep && i < c.stages.size(); ++i)
        if (c.stages[i].learning_rate != c.learning_rate)
            return invalid(
                "%s: stage %zu of '%s' has the rate %g, but 'opt.lr_schedule' is step, which "
                "lowers that of the run, %g; expected another schedule, or no base_lr in stages",
                what, i, kList, c.stages[i].learning_rate, c.learning_rate);
    return {};
}

}  // namespace

std::string stage_name(const std::string& what, std::size_t stage) {
    return format("%s: stage %zu of '%s'", what.c_str(), stage, kList);
}

Result<std::vector<std::string>> stage_names(const Config& config) {
    if (has_stage(config, kMostStages))
        return invalid("%s: '%s' has more than %zu stages", config.what().c_str(), kList,
                       kMostStages);
    std::vector<std::string> names;
    const std::size_t count = stages_in(config);
    for (std::size_t i = 0; i < count; ++i)
        for (const Key* const key : keys_of_stage()) names.push_back(name_in(i, *key));
    return names;
}

Status read_stages(const Config& config, TrainConfig& c) {
    SPLAT_TRY(check_list(config));
    const std::size_t count = stages_in(config);
    if (count == 0) return {};
    std::vector<TrainConfig> stages;
    std::uint64_t sum = 0;
    for (std::size_t i = 0; i < count; ++i) {
        SPLAT_ASSIGN(TrainConfig stage, read_stage(values_of(config, i), c));
        sum += stage.iterations;
        stages.push_back(std::move(stage));
    }
    c.stages = std::move(stages);
    SPLAT_TRY(check_beside(config, c, sum));
    c.iterations = sum;
    return {};
}

std::vector<ConfigEntry> stage_entries(const TrainConfig& c) {
    std::vector<ConfigEntry> entries;
    for (std::size_t i = 0; i < c.stages.size(); ++i)
        for (const Key* const key : keys_of_stage()) {
            ConfigEntry entry = key->field.write(*key, {{}, c.stages[i]});
            if (key->name != std::string_view(kSum) &&
                same_value(entry, key->field.write(*key, {{}, c})))
                continue;
            entry.key = name_in(i, *key);
            entries.push_back(std::move(entry));
        }
    return entries;
}

bool all_stages_replace(const Key& key, const TrainConfig& c) {
    if (c.stages.empty() || key.name == std::string_view(kSum)) return false;
    const std::vector<const Key*> keys = keys_of_stage();
    if (std::ranges::find(keys, &key) == keys.end()) return false;
    const ConfigEntry whole = key.field.write(key, {{}, c});
    return std::ranges::none_of(c.stages, [&](const TrainConfig& stage) {
        return same_value(key.field.write(key, {{}, stage}), whole);
    });
}

std::string stages_text(const Config& config) {
    std::string text;
    const std::size_t count = stages_in(config);
    for (std::size_t i = 0; i < count; ++i) {
        const Config values = values_of(config, i);
        std::string stage;
        for (const ConfigEntry& entry : values.entries())
            stage += (stage.empty() ? "" : ", ") + entry.key.substr(entry.key.find('.') + 1) +
                     ": " + config_value_text(entry);
        text += (i == 0 ? "{" : ", {") + stage + "}";
    }
    return "[" + text + "]";
}

Config without_stages(const Config& base, const Config& changes) {
    const std::string below = std::string(kList) + ".";
    const bool replaced = changes.find(kList) != nullptr;
    const bool given = std::ranges::any_of(
        changes.entries(), [&](auto& entry) { return entry.key.starts_with(below); });
    Config kept(base.what());
    for (const ConfigEntry& entry : base.entries())
        if (!(replaced && entry.key.starts_with(below)) && !(given && entry.key == kSum))
            kept.set(entry);
    return kept;
}

}  // namespace splat::config
