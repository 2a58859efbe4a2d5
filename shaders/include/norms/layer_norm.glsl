// Shared by the passes of layer_norm over pixels: kLanes invocations of a workgroup share a column of quads, neighbours
// have neighbouring columns. Needs `dims` (LayerNormParams). One lane has no barrier, as CPUs want it.

#ifndef SPLAT_LAYER_NORM_GLSL
#define SPLAT_LAYER_NORM_GLSL

#include "channels.glsl"
#include "workgroup.glsl"

layout(constant_id = kLayerNormLanesId) const uint kLanes = 1;

// Quads of a turn: lavapipe pays for each loop-carried number in each turn.
const uint kUnroll = TEXEL_LOADS == 1 ? 4 : 1;

shared vec4 lane_scratch[kWorkgroupSize];

// The sum of the lanes of a column, in their order. Every invocation must call.
vec4 sum_of_lanes(vec4 value) {
    if (kLanes == 1) return value;
    const uint width = gl_WorkGroupSize.x / kLanes;
    barrier();  // the previous call's scratch may still be read
    lane_scratch[gl_LocalInvocationID.x] = value;
    barrier();
    vec4 sum = vec4(0);
    for (uint lane = 0; lane < kLanes; ++lane) sum += lane_scratch[lane * width + gl_LocalInvocationID.x % width];
    return sum;
}

float across(vec4 v) { return (v.x + v.y) + (v.z + v.w); }

uint first_quad() { return gl_LocalInvocationID.x / (gl_WorkGroupSize.x / kLanes); }

uint column_of(uint groups_x) {
    const uint width = gl_WorkGroupSize.x / kLanes;
    return (gl_WorkGroupID.y * groups_x + gl_WorkGroupID.x) * width + gl_LocalInvocationID.x % width;
}

#endif
