#ifndef SPLAT_RELU_PARAMS_H
#define SPLAT_RELU_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct ReluParams {
    uint quads;
    uint groups_x;  // workgroups per row of the dispatch, see src/ops/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(ReluParams) <= 128);
}
#endif

#endif
