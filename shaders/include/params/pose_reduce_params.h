#ifndef SPLAT_POSE_REDUCE_PARAMS_H
#define SPLAT_POSE_REDUCE_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct PoseReduceParams {
    uint groups;      // partial sums per view
    uint views;
    uint accumulate;  // 1: added to the existing values
};

#ifdef __cplusplus
static_assert(sizeof(PoseReduceParams) <= 128);
}
#endif

#endif
