#ifndef SPLAT_BLEND_PARAMS_H
#define SPLAT_BLEND_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kBlendExtraId = 10u;     // forward: write depth and contributors
SPLAT_SPEC_ID kBlendNormalsId = 11u;   // forward: normals instead of colours, without background
SPLAT_SPEC_ID kBlendEarlyOutId = 12u;  // both passes, not plain: end where every pixel has stopped
SPLAT_SPEC_ID kBlendSkipBlocksId =
    13u;  // both passes, not plain: leave out what a block of pixels cannot see
SPLAT_SPEC_ID kBlendDepthId = 14u;            // backward: grad_depth is given
SPLAT_SPEC_ID kBlendAbsoluteId = 15u;         // backward: also sum |dL/du| and |dL/dv|
SPLAT_SPEC_ID kBlendStraightThroughId = 16u;  // backward, cpu: straight_through below
SPLAT_SPEC_ID kBlendSizesId = 17u;            // both passes: views have their own sizes
SPLAT_SPEC_ID kBlendIdsId = 18u;  // forward: write the Gaussian of the largest weight, too
SPLAT_SPEC_ID kBlendContributionsId = 19u;  // backward: also sum the weights and count pixels
SPLAT_SPEC_ID kBlendPartsId = 20u;          // both passes: a part of each long list, see walks()
SPLAT_SPEC_ID kBlendMaxSubgroupsId = 21u;   // backward, gpu: most subgroups of a workgroup
SPLAT_SPEC_ID kBlendCutId = 22u;            // both passes: a Gaussian ends at 3 sigma
SPLAT_SPEC_ID kBlendMedianId = 23u;         // forward: write the median depth
SPLAT_SPEC_ID kBlendRaysId = 24u;           // forward: opacity at the maximum along the ray

struct BlendParams {
    uint width;
    uint height;
    uint tiles_x;
    uint row_begin;    // first tile row of the window
    uint rows;         // tile rows of the window
    float stop_below;  // a pixel stops before its transmittance falls below this
    uint views;
    uint spread;            // see spread_tile.glsl; 0: tiles in order
    uint straight_through;  // backward: 1 passes the gradient through the clamp of alpha
    uint gaussians;         // per view
    uint part_begin;        // entries before the part, see walks(); 0 without kBlendPartsId
    uint part_entries;      // lists of more are walked in parts
    uint rays;              // kRays: first vec4 of the ray forms behind the splats
    float near_plane;       // kRays: a pixel sees no maximum before it
};

#ifdef __cplusplus
static_assert(sizeof(BlendParams) <= 128);
}
#endif

#endif
