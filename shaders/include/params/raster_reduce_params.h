#ifndef SPLAT_RASTER_REDUCE_PARAMS_H
#define SPLAT_RASTER_REDUCE_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kReduceRangesId = 10u;  // views see ranges, see raster/view_ranges.glsl
SPLAT_SPEC_ID kReduceHalvesId = 11u;  // pixels are float16 instead of bytes

struct PoseReduceParams {
    uint groups;  // partial sums per view, unless views see ranges
    uint accumulate;  // 1: added to the existing values
    uint size;        // Gaussians of a partial sum
    uint quads;       // per partial sum: 3 rows of [R|t], 4 with the intrinsics
};

struct ContributionReduceParams {
    uint gaussians;  // per view
    uint views;
    uint accumulate;  // 1: added to the existing values
    uint groups_x;    // workgroups per row of the dispatch, see src/vk/launch.h
    uint begins;      // index in the counts where first records begin
    uint stride;      // vec2 from one record to the next
    uint first;       // vec2 of the first one that is summed
    uint layer;       // which ranges; layers after the first add a sum of their own
};

struct RasterPixelsParams {
    uint count;     // pixels
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(RasterPixelsParams) <= 128);
static_assert(sizeof(PoseReduceParams) <= 128);
static_assert(sizeof(ContributionReduceParams) <= 128);
}
#endif

#endif
