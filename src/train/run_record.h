#pragma once

#include <cmath>
#include <string>

#include "core/json_writer.h"
#include "data/dataset.h"
#include "model/weights.h"
#include "train/trainer.h"
#include "vk/device.h"

namespace splat::train {

/// The figures of a run that its reports share.
struct RunFigures {
    std::string folder;
    std::uint64_t step = 0, iterations = 0;
    std::uint64_t skipped = 0;  ///< attempts that updated nothing
    double loss = 0;            ///< loss of the latest step
    double validation_psnr = NAN, best_validation_psnr = 0;
    std::uint64_t peak_bytes = 0;   ///< most device memory so far
    std::optional<TrainStep> last;  ///< the latest attempt of this process
};

/// The weights that a run was started from by its caller; no file: those of the configuration, else random.
struct Start {
    std::string file;
    model::LoadOptions options;
};

/// The objects of a run's surroundings, for its record.
struct RunSurroundings {
    const char* state = "";
    std::string library;  ///< version of the library
    const vk::Device* device = nullptr;
    const data::Dataset* dataset = nullptr;
    std::uint64_t seed = 0, parameters = 0, trainable = 0;
    const Start* start = nullptr;
    std::string error;  ///< what made it fail
};

/// The member "ledger" of a report: what was drawn and finite in a step, or null.
void add_ledger(JsonWriter& json, const std::optional<TrainStep>& step);

/// JSON: {"schema", "folder", "step", "iterations", "skipped", "loss", "val_psnr", "best_val_psnr",
/// "peak_bytes", "ledger"}.
std::string figures_json(const RunFigures& figures);

/// The text of run.json: the figures, then {"state", "library", "device", "seed", "parameters", "trainable",
/// "data", "start": null or {"file", "graft", "take_rays", "maps"}}, and "error" of a run that failed.
std::string run_json(const RunFigures& figures, const RunSurroundings& surroundings);

/// The start in the text of a run.json. Errors: kFormat.
Result<Start> start_of(std::string_view run_json, const char* what);

/// Refuse data whose steps are not those of the run, as far as a run.json tells: another split or stored resolution,
/// other objects, by their names, or numbers of views. Data may be moved, or imported into another format. False if the
/// run.json, of an earlier version, has no hash of the names. Errors: kInvalidArgument.
Result<bool> check_same_data(std::string_view run_json, const data::Dataset& dataset);

/// Numbers of a step besides its own results.
struct StepFacts {
    double psnr = 0;
    std::uint64_t skipped = 0;
    double seconds = 0;  ///< since the first step of this process
    std::uint64_t peak_bytes = 0;
};

/// The line of metrics.jsonl for a step.
std::string step_json(const TrainStep& step, const StepFacts& facts,
                      const config::TrainConfig& config);

}  // namespace splat::train
