#pragma once

#include "bench/model/model_bench.h"
#include "vkrun/cli/json.h"

namespace vkrun::bench {

/// Adds the figures of both kinds of passes to a report. Each kind is measured on a model of its
/// own, one after the other. The profile comes from one more pass of the last model. `vkrun bench
/// model --help` names the keys.
void measure_passes(Json& json, splat_device device, const ModelBenchOptions& options);

/// Print what measure_passes() added.
void print_passes(const Json& json);

/// The line about the peer, from its description of itself.
void print_peer(const Json& peer);

}  // namespace vkrun::bench
