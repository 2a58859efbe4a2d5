#ifndef SPLAT_DROPOUT_PARAMS_H
#define SPLAT_DROPOUT_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct DropoutParams {
    uint quads;
    uint stream;     // distinguishes the calls of one step
    uint threshold;  // random words below it drop their element
    float scale;     // 1 / (1 - p)
    uint groups_x;   // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(DropoutParams) <= 128);
}
#endif

#endif
