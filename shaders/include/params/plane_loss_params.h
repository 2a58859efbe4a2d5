#ifndef SPLAT_PLANE_LOSS_PARAMS_H
#define SPLAT_PLANE_LOSS_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct PlaneLossParams {
    uint planes;
    float scale;    // backward: 1 / Gaussians of the set
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(PlaneLossParams) <= 128);
}
#endif

#endif
