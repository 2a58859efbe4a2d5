#ifndef SPLAT_CONV2D_WINOGRAD_PARAMS_H
#define SPLAT_CONV2D_WINOGRAD_PARAMS_H

#include "params/spec_ids.h"

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

// Specialisation constants.
SPLAT_SPEC_ID kWinogradTileId = 10u;         // outputs of a tile along an axis, 2 or 4
SPLAT_SPEC_ID kWinogradColumnsId = 11u;      // forward product: tiles of an invocation
SPLAT_SPEC_ID kWinogradBlocksId = 12u;       // forward product: blocks of 8 output channels of an invocation
SPLAT_SPEC_ID kWinogradDepthId = 13u;        // forward product: quads of channels per turn of the loop, 1 or 2
SPLAT_SPEC_ID kWinogradPackedQuadsId = 14u;  // forward weight: quads of input channels of an invocation
SPLAT_SPEC_ID kWinogradQuadsId = 15u;        // backward weight product: quads of input channels of a lane, 1 or 2
SPLAT_SPEC_ID kWinogradWholeId = 16u;        // weights: the taps of a quad of input channels are nine quads
SPLAT_SPEC_ID kWinogradResidualId = 17u;     // forward output: there is a residual
SPLAT_SPEC_ID kWinogradExactId = 18u;        // forward output: tiles cover the image exactly and come in eights
SPLAT_SPEC_ID kWinogradAccumulateId = 19u;   // backward weight output: add to the existing values
SPLAT_SPEC_ID kWinogradPartsId = 20u;        // inputs, for GPUs: quads of channels of an invocation, 1 or 2
SPLAT_SPEC_ID kWinogradReplicateId = 21u;    // forward input: beyond the image is its nearest pixel, else 0

// A 3x3 convolution by Winograd's algorithm, one slice of the tiles at a time. Tiles are numbered image by
// image, row by row.
struct Conv2dWinogradParams {
    uint n;
    uint in_channels;  // for the product at hand: the gradient of the input swaps the two
    uint out_channels;
    uint height;
    uint width;
    uint tiles_x;     // tiles per row of an image
    uint tiles_y;     // rows of tiles of an image
    uint first_tile;  // first tile of the slice
    uint tiles;       // in the slice
    uint stride;      // from one channel octet to the next in transformed tensors, >= tiles
    uint has_bias;
    float scale;
    uint transposed;  // flip the weight's taps and swap its channels
    uint slice;       // backward weight: position of this slice's product
    uint slices;      // backward weight: how many products are summed
    uint part_tiles;  // backward weight: tiles of a part of the slice's sum, a multiple of 8
    uint places;      // (m + 2)^2
    uint groups_x;    // workgroups per row of the dispatch, see src/vk/launch.h
    float one;        // 1, unknown to a compiler: see store.glsl
};

#ifdef __cplusplus
static_assert(sizeof(Conv2dWinogradParams) <= 128);
}
#endif

#endif
