#ifndef SPLAT_TILE_BIN_PARAMS_H
#define SPLAT_TILE_BIN_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#define SPLAT_STAT inline constexpr uint
#else
#define SPLAT_STAT const uint
#endif

// Specialisation constants.
SPLAT_SPEC_ID kTileBinByIndexId = 10u;  // sums by index instead of depth
SPLAT_SPEC_ID kTileBinSlotsId = 11u;    // pairs get slots: records of the backward pass

// Words of the statistics that one pass writes.
SPLAT_STAT kStatVisible = 0u;     // entries of the depth order
SPLAT_STAT kStatNeeded = 1u;      // pairs there are, at most 2^32 - 1
SPLAT_STAT kStatPairs = 2u;       // pairs made: 0 if there are more than fit
SPLAT_STAT kStatLongest = 3u;     // longest list of a tile
SPLAT_STAT kStatEmptyTiles = 4u;  // tiles without a list
SPLAT_STAT kStatLarge = 5u;       // footprints that are not packed
SPLAT_STAT kStatNotFinite = 6u;   // items refused for a value that is not finite; by project_forward
SPLAT_STAT kStatWords = 8u;

struct TileBinParams {
    uint gaussians;  // per view
    uint items;      // gaussians * views
    uint capacity;   // pairs that the arrays hold
    uint lanes;      // contiguous chunks of the scan, one per lane; per workgroup in tile_bin_*_cpu
    uint width;
    uint height;
    uint row_begin;
    uint row_end;
    uint tiles;  // tiles of the window, all views
    uint groups_x;
    uint stride;  // invocations that share the large footprints
    uint views;
};

#undef SPLAT_STAT
#ifdef __cplusplus
static_assert(sizeof(TileBinParams) <= 128);
}
#endif

#endif
