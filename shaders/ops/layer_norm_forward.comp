#version 460
// Per pixel, over its channels: mean, rstd = 1 / sqrt(var + eps), and y = gamma * (x - mean) * rstd + beta.
// A workgroup has its size / kLanes pixels; kLanes invocations share the quads of a pixel.
// Bindings: x, gamma, beta (read as quads), y, mean [2,N*P] (group_norm.glsl), rstd [N*P]. Specialisation: kLanes.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/layer_norm_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, gamma);
QUADS(2, beta);
QUADS_OUT(3, y);
layout(set = 0, binding = 4, std430) writeonly buffer Mean { float mean_out[]; };
layout(set = 0, binding = 5, std430) writeonly buffer Rstd { float rstd_out[]; };
layout(push_constant) uniform Push { LayerNormParams dims; };

#include "norms/group_norm.glsl"
#include "norms/layer_norm.glsl"

const float kSmall = 9.5367431640625e-7;  // 2^-20: sums of 2^20 channels do not overflow
const float kSquaresFit = 1e16;           // 2^20 squares do not overflow

void main() {
    const uint own = column_of(dims.groups_x);
    const uint column = min(own, dims.columns - 1);
    const uint quads = (dims.channels + 3) / 4;
    const uint first = first_quad();
    const float count = float(dims.channels);

    // A first guess of the mean, which may lack digits, and how far the numbers lie apart.
    const float pivot = LD4(x, column).x * kSmall;
    vec4 sum = vec4(0);
    vec4 lowest = vec4(0);
    vec4 highest = vec4(0);
    for (uint q = first; q < quads; q += kLanes) {
        const vec4 d = channels_below(LD4(x, q * dims.columns + column) * kSmall - pivot, 4 * q, dims.channels);
        sum += d;
        lowest = min(lowest, d);
        highest = max(highest, d);
    }
    const vec4 apart = highest - lowest;
    const vec4 all = sum_of_lanes(vec4(across(sum), max(max(apart.x, apart.y), max(apart.z, apart.w)), 0, 0));
    const float unit = all.y > kSquaresFit * kSmall ? kShrink : 1.0;
    const float guess = (pivot + all.x / count) * (unit == 1.0 ? 1.0 / kSmall : kShrink / kSmall);

    vec4 residual = vec4(0);
    vec4 square = vec4(0);
    for (uint q = first; q < quads; q += kLanes) {
        const vec4 d = channels_below(LD4(x, q * dims.columns + column) * unit - guess, 4 * q, dims.channels);
        residual += d;
        square += d * d;
    }
    const vec2 moments = sum_of_lanes(vec4(across(residual), across(square), 0, 0)).xy / count;
    const vec2 mean = split_mean(guess, moments.x);
    const float rstd = inverse_deviation(moments.y - moments.x * moments.x, dims.eps, unit);

    if (own >= dims.columns) return;
    for (uint q = first; q < quads; q += kLanes) {
        const uint at = q * dims.columns + column;
        const vec4 t = LD4(gamma, q) * (((LD4(x, at) * unit - mean.x) - mean.y) * rstd) + LD4(beta, q);
        ST4(y, at, channels_below(t, 4 * q, dims.channels));
    }
    if (first != 0) return;
    mean_out[column] = mean.x * per_unit(unit);
    mean_out[dims.columns + column] = mean.y * per_unit(unit);
    rstd_out[column] = rstd * unit;
}
