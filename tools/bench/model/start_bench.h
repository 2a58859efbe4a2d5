#pragma once

#include <string>

#include "bench/model/model_bench.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

struct StartBenchOptions : ModelBenchOptions {
    std::string file;  ///< configuration; empty: the cars model
    std::string device = "best";
};

/// The process of one round: prints what ModelPeer waits for.
void answer_once(const StartBenchOptions& options);

/// Starts `vkrun bench start --once` again and again. `vkrun bench start --help` names the keys of the
/// result.
Json measure_starts(const StartBenchOptions& options);

void print_starts(const Json& json, const StartBenchOptions& options);

}  // namespace vkrun::bench
