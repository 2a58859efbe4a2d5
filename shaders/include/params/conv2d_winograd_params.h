#ifndef SPLAT_CONV2D_WINOGRAD_PARAMS_H
#define SPLAT_CONV2D_WINOGRAD_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// A 3x3 convolution by Winograd's algorithm, one slice of the tiles at a time. Tiles are numbered image by
// image, row by row.
struct Conv2dWinogradParams {
    uint n;
    uint in_channels;  // of the product at hand: the gradient of the input swaps the two
    uint out_channels;
    uint height;
    uint width;
    uint tiles_x;     // tiles per row of an image
    uint tiles_y;     // rows of tiles of an image
    uint first_tile;  // of the slice
    uint tiles;       // in the slice
    uint stride;      // from one channel octet to the next in transformed tensors, >= tiles
    uint has_bias;
    float scale;
    uint transposed;  // of the weight: flip the taps and swap the channels
    uint slice;       // backward weight: position of this slice's product
    uint slices;      // backward weight: how many products are summed
    uint places;      // (m + 2)^2
    uint groups_x;    // workgroups per row of the dispatch, see src/ops/launch.h
    float one;        // 1, unknown to a compiler: see store.glsl
};

#ifdef __cplusplus
static_assert(sizeof(Conv2dWinogradParams) <= 128);
}
#endif

#endif
