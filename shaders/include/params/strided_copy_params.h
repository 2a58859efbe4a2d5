#ifndef SPLAT_STRIDED_COPY_PARAMS_H
#define SPLAT_STRIDED_COPY_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kStridedCopyChannelsId = 10u;    // floats of an element
SPLAT_SPEC_ID kStridedCopyAccumulateId = 11u;  // add to y

// Strides and offsets in floats.
struct StridedCopyParams {
    uint begin;  // first element copied; bindings begin with element 0
    uint count;  // one past the last
    uint in_stride;
    uint in_offset;
    uint out_stride;
    uint out_offset;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(StridedCopyParams) <= 128);
}
#endif

#endif
