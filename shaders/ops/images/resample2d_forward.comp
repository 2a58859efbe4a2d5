#version 460
// y = x resampled, to twice or half the size; the equations are in resample2d.glsl.
// One invocation computes one quad. Bindings: x quads, filter [taps], y quads. Specialisation as there.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
layout(set = 0, binding = 1, std430) readonly buffer Filter { float filter_taps[]; };
QUADS_OUT(2, y);
layout(push_constant) uniform Push { Resample2dParams params; };

#include "launch.glsl"
#include "images/resample2d.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    uint plane, row, column;
    if (resample_place(i, plane, row, column)) ST4(y, i, resample(plane, row, column));
}
