#ifndef SPLAT_ACTIVATION_PARAMS_H
#define SPLAT_ACTIVATION_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct ActivationParams {
    uint quads;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    uint form;      // formula of the operator; 0 where it has one
    uint channels;  // C; those beyond in the last quad stay zero
    uint pixels;    // N * P
    float least;  // bounds, of operators that have some
    float most;
};

#ifdef __cplusplus
static_assert(sizeof(ActivationParams) <= 128);
}
#endif

#endif
