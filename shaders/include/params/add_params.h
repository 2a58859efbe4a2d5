#ifndef SPLAT_ADD_PARAMS_H
#define SPLAT_ADD_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct AddParams {
    uint quads;
    float scale;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(AddParams) <= 128);
}
#endif

#endif
