// Shared by the passes of edge_loss. The derivative along an axis is the difference (-1, 0, 1) along it and the
// smoothing filter (side, centre, side) across it; indices beyond the image are reflected at its border
// pixels (reflect-101).

#ifndef SPLAT_EDGE_LOSS_GLSL
#define SPLAT_EDGE_LOSS_GLSL

#include "load.glsl"
#include "params/edge_loss_params.h"

layout(push_constant) uniform Push { EdgeLossParams dims; };

int column_of(uint i) { return int(i % dims.width); }
int row_of(uint i) { return int(i / dims.width % dims.height); }

int reflected(int at, uint size) {
    const int last = int(size) - 1;
    const int inside = at < 0 ? -at : at > last ? 2 * last - at : at;
    return size == 1 ? 0 : inside;
}

float smoothing(int tap) { return tap == 0 ? dims.centre : dims.side; }

#endif
