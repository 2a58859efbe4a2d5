#ifndef SPLAT_GAUSSIAN_HEAD_PARAMS_H
#define SPLAT_GAUSSIAN_HEAD_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct GaussianHeadParams {
    uint images;  // batch * views
    uint pixels;  // of an image
    float znear;
    float depth_range;  // zfar - znear
    uint isotropic;     // 1: all three scales come from the first channel
    uint activate;      // 0: opacity and scales straight from the network
    uint has_focal;
    uint has_origin;
    uint groups_x;  // workgroups per row of the dispatch, see src/ops/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(GaussianHeadParams) <= 128);
}
#endif

#endif
