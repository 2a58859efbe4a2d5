#ifndef SPLAT_GAUSSIAN_HEAD_PARAMS_H
#define SPLAT_GAUSSIAN_HEAD_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct GaussianHeadParams {
    uint images;        // b * v
    uint pixels;        // per image
    uint focals;        // 1: rays are divided by each image's focals
    uint distances;     // 1: a plane of distances is added to the depth
    uint isotropic;     // 1: the first scale for all three axes
    uint activate;      // 0: opacity and scales as they are, logits and logarithms
    uint sh_transform;  // 1: coefficients of degree 1 are turned into the world
    float znear;
    float zfar;
    uint groups_x;  // workgroups per row of the dispatch, see src/ops/launch.h
};

#ifdef __cplusplus
static_assert(sizeof(GaussianHeadParams) <= 128);
}
#endif

#endif
