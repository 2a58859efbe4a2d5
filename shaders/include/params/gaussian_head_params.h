#ifndef SPLAT_GAUSSIAN_HEAD_PARAMS_H
#define SPLAT_GAUSSIAN_HEAD_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kGaussianHeadOffsetId = 10u;  // 1: three channels move the point off its ray
SPLAT_SPEC_ID kGaussianHeadDegreeId = 11u;  // degree of the spherical harmonics, 0 or 1

struct GaussianHeadParams {
    uint images;  // batch * views
    uint pixels;  // pixels per image
    float znear;
    float depth_range;  // zfar - znear
    uint isotropic;     // 1: all three scales come from the first channel
    uint activate;      // 0: opacity and scales straight from the network
    uint has_focal;
    uint has_origin;
    uint groups_x;  // workgroups per row of the dispatch, see src/vk/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(GaussianHeadParams) <= 128);
}
#endif

#endif
