#pragma once

#include <string>

#include "data/dataset.h"
#include "model/weights.h"
#include "run/task.h"
#include "train/trainer.h"
#include "vk/device.h"

namespace splat::train {

/// The weights that a run was started from by its caller; no file: those of the configuration, else random.
struct Start {
    std::string file;
    model::LoadOptions options;
};

/// What was drawn and finite in a step.
run::Numbers ledger_of(const TrainStep& step);

/// Numbers of all trainable parameters.
std::uint64_t trainable_of(const nn::Parameters& parameters);

/// The facts of a training in its run.json: the members "device", "seed", "parameters", "trainable", "data" and
/// "start": null or {"file", "graft", "take_rays", "maps"}.
void add_facts(JsonWriter& json, const vk::Device& device, std::uint64_t seed,
               const nn::Parameters& parameters, const data::Dataset& dataset, const Start& start);

/// What check_same_data() compares, for the ranks of a run: pairs of a name and its value.
void add_facts(std::vector<std::pair<std::string, std::string>>& facts,
               const data::Dataset& dataset);

/// The start in a run.json, which `path` names. Errors: kFormat.
Result<Start> start_of(const JsonTree& run_json, const std::string& path);

/// Refuse data whose steps are not those of the run, as far as a run.json tells: another split or stored resolution,
/// other objects, by their names, or numbers of views. Data may be moved, or imported into another format. False if the
/// run.json, of an earlier version, has no hash of the names. Errors: kInvalidArgument.
Result<bool> check_same_data(const JsonTree& run_json, const data::Dataset& dataset);

}  // namespace splat::train
