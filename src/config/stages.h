#pragma once

#include <string>
#include <vector>

#include "config/config_keys.h"

namespace splat::config {

/// Most stages of a training.
inline constexpr std::size_t kMostStages = 100;

/// "config.yaml: stage 0 of 'opt.stages'"
std::string stage_name(const std::string& what, std::size_t stage);

/// Names that the stages of a configuration may have: "opt.stages.0.base_lr". Errors: kInvalidArgument for more than
/// kMostStages.
Result<std::vector<std::string>> stage_names(const Config& config);

/// Read opt.stages, a list of maps of keys of opt. What a stage does not give, it has from `c`, which the other keys
/// have set; `c` gets the updates of all stages together.
///
/// Errors: kInvalidArgument, naming file and stage, for values that contradict each other or `c`.
Status read_stages(const Config& config, TrainConfig& c);

/// Entries of all stages: the updates, and what differs from `c`.
std::vector<ConfigEntry> stage_entries(const TrainConfig& c);

/// True if no stage has the value that `key` has for all.
bool all_stages_replace(const Key& key, const TrainConfig& c);

/// The stages of a configuration on one line.
std::string stages_text(const Config& config);

/// Before stages are changed: let go of those that a new list replaces, and of the updates that the old ones implied,
/// unless none follow.
Config without_stages(const Config& base, const Config& changes);

}  // namespace splat::config
