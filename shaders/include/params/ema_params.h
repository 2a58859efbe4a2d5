#ifndef SPLAT_EMA_PARAMS_H
#define SPLAT_EMA_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct EmaParams {
    uint quads;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
    float rest;     // 1 - decay
};

#ifdef __cplusplus
static_assert(sizeof(EmaParams) <= 128);
}
#endif

#endif
