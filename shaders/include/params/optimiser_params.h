#ifndef SPLAT_OPTIMISER_PARAMS_H
#define SPLAT_OPTIMISER_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// One step; the host computes values that depend on its number in float64.
struct AdamParams {
    uint quads;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    float beta1;
    float rest1;  // 1 - beta1
    float beta2;
    float rest2;
    float step_size;   // learning rate / (1 - beta1^step)
    float root_scale;  // 1 / sqrt(1 - beta2^step)
    float eps;
};

struct EmaParams {
    uint quads;
    uint groups_x;
    float rest;  // 1 - decay
};

// Specialisation constants.
SPLAT_SPEC_ID kGatherRowsLengthId = 10u;  // elements of a row
SPLAT_SPEC_ID kGatherRowsFreshId = 11u;   // new rows are those of `fresh`, else zero

struct GatherRowsParams {
    uint words;  // elements of y
    uint groups_x;
};

#ifdef __cplusplus
static_assert(sizeof(AdamParams) <= 128);
}
#endif

#endif
