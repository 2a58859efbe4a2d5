#ifndef SPLAT_BLEND_PARAMS_H
#define SPLAT_BLEND_PARAMS_H

#ifdef __cplusplus
#include <cstdint>
namespace splat::params {
using uint = std::uint32_t;
#endif

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
};

#ifdef __cplusplus
static_assert(sizeof(BlendParams) <= 128);
}
#endif

#endif
