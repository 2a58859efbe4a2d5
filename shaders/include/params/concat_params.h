#ifndef SPLAT_CONCAT_PARAMS_H
#define SPLAT_CONCAT_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct ConcatParams {
    uint columns;  // n * p
    uint a;        // channels of the first part
    uint b;        // channels of the second part
    uint offset;   // concat_backward: first channel of the part
    uint count;    // channels of the part
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(ConcatParams) <= 128);
}
#endif

#endif
