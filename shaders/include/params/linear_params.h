#ifndef SPLAT_LINEAR_PARAMS_H
#define SPLAT_LINEAR_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

struct LinearParams {
    uint rows;          // columns of the quad layout: n * h * w for a 1x1 convolution
    uint in_features;   // of the product at hand: the backward pass swaps the two
    uint out_features;
    uint has_bias;
    uint transposed;  // linear_pack_weight: 1 packs the transpose
    uint accumulate;  // 1: parameter gradients are added to the existing values
    uint groups_x;    // workgroups per row of the dispatch, see src/ops/launch.h; fast products: of rows per layer
    uint slices;      // linear_backward_weight: the rows are summed in so many slices
    uint has_residual;
    float scale;
};

#ifdef __cplusplus
static_assert(sizeof(LinearParams) <= 128);
}
#endif

#endif
