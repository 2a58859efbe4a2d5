// Shared by the passes of edge_loss. The derivative along an axis is the difference (-1, 0, 1) along it and the
// smoothing filter (side, centre, side) across it; indices beyond the image are reflected at its border
// pixels (reflect-101).

#ifndef SPLAT_EDGE_LOSS_GLSL
#define SPLAT_EDGE_LOSS_GLSL

#include "load.glsl"
#include "params/image_loss_params.h"

layout(constant_id = kImageLossScharrId) const bool kScharr = false;
layout(push_constant) uniform Push { ImageLossParams dims; };

int column_of(uint i) { return int(i % dims.width); }
int row_of(uint i) { return int(i / dims.width % dims.height); }

int reflected(int at, uint size) {
    const int last = int(size) - 1;
    const int inside = at < 0 ? -at : at > last ? 2 * last - at : at;
    return size == 1 ? 0 : inside;
}

// A ramp of 1 per pixel, whose difference over two pixels is 2, has the derivative 1.
float smoothing(int tap) { return tap == 0 ? (kScharr ? 10.0 / 32 : 2.0 / 8) : (kScharr ? 3.0 / 32 : 1.0 / 8); }

#endif
