#ifndef SPLAT_OPTIMISER_PARAMS_H
#define SPLAT_OPTIMISER_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Scalars of a step are two quads of a buffer, so that a recorded dispatch runs for one step after another:
// beta1, 1 - beta1, beta2, 1 - beta2; learning rate / (1 - beta1^step), 1 / sqrt(1 - beta2^step), eps, and 1 for a step
// that is skipped, else 0.
// The host computes those that depend on its number in float64.
struct AdamParams {
    uint quads;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    uint rule;      // the scalars are quads 2 rule and 2 rule + 1
};

// The scalars are a quad: 1 - decay first; last 1 for a step that leaves the averages, else 0.
struct EmaParams {
    uint quads;
    uint groups_x;
};

// Sizes are quads.
struct StepDecisionParams {
    uint chunks;     // partial results of tensor_stats, each two quads
    uint notes;      // what is kept of a step
    uint checked;    // numbers of the notes that must be finite, from the first on, in blocks
    uint block;      // size of a block
    uint unchecked;  // first quads of a block, which may hold any numbers
    uint rows;       // entries of the table of scalars
    uint entry;      // size of one: two quads for each rule of Adam, then one of EMA
    uint ema_at;     // place of EMA's quad among the scalars of the step
};

// Specialisation constants.
SPLAT_SPEC_ID kGatherRowsLengthId = 10u;  // elements of a row
SPLAT_SPEC_ID kGatherRowsFreshId = 11u;   // new rows are those of `fresh`, else zero

struct GatherRowsParams {
    uint words;  // elements of y
    uint groups_x;
};

#ifdef __cplusplus
}
#endif

#endif
