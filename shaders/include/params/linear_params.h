#ifndef SPLAT_LINEAR_PARAMS_H
#define SPLAT_LINEAR_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kLinearColumnsId = 10u;   // fast product: rows of x of an invocation
SPLAT_SPEC_ID kLinearBlocksId = 11u;    // fast product: blocks of 8 output features of an invocation
SPLAT_SPEC_ID kLinearResidualId = 12u;  // fast product: there is a residual
SPLAT_SPEC_ID kLinearDepthId = 13u;     // fast product: quads of k per turn of the loop, 1 or 2
SPLAT_SPEC_ID kLinearOutQuadsId = 14u;  // fast backward weight: quads of output features of a lane, up to 8
SPLAT_SPEC_ID kProductTileId = 30u;     // products/product.glsl, in all families: side of a tile, 64 or 128

struct LinearParams {
    uint rows;          // columns of the quad layout: n * h * w for a 1x1 convolution
    uint in_features;   // for the product at hand: the backward pass swaps the two
    uint out_features;
    uint has_bias;
    uint transposed;  // linear_pack_weight: 1 packs the transpose
    uint accumulate;  // 1: parameter gradients are added to the existing values
    uint groups_x;    // workgroups per row of the dispatch, see src/vk/launch.h; fast products: of rows per layer
    uint slices;      // linear_backward_weight: number of slices in which the rows are summed
    uint has_residual;
    float scale;
};

#ifdef __cplusplus
static_assert(sizeof(LinearParams) <= 128);
}
#endif

#endif
