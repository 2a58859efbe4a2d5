#ifndef SPLAT_SPLIT3_PARAMS_H
#define SPLAT_SPLIT3_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct Split3Params {
    uint columns;  // n * p
    uint c;        // channels of each part
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(Split3Params) <= 128);
}
#endif

#endif
