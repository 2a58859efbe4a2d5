#version 460
// Per pixel, over its channels: mean, rstd = 1 / sqrt(var + eps), and y = gamma * (x - mean) * rstd + beta.
// A workgroup has its size / kLanes pixels; kLanes invocations share the quads of a pixel.
// Bindings: x, gamma, beta (read as quads), y, mean [2,N*P] (group_norm.glsl), rstd [N*P]. Specialisation: kLanes.
#extension GL_EXT_control_flow_attributes : require
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

// A mean is guess + residual; both, and the deviation, in units of 1 / unit.
struct Statistics { float guess, residual, variance, unit; };

vec2 moments_about(float guess, float unit, uint column, uint begin) {
    const uint whole = dims.channels / 4;
    vec4 first = vec4(0);
    vec4 second = vec4(0);
    uint q = begin;
    for (; q + (kUnroll - 1) * kLanes < whole; q += kUnroll * kLanes)
        [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
            const vec4 d = LD4(x, (q + u * kLanes) * dims.columns + column) * unit - guess;
            first += d;
            second += d * d;
        }
    for (; 4 * q < dims.channels; q += kLanes) {
        const vec4 d = channels_below(LD4(x, q * dims.columns + column) * unit - guess, 4 * q, dims.channels);
        first += d;
        second += d * d;
    }
    return sum_of_lanes(vec4(across(first), across(second), 0, 0)).xy / float(dims.channels);
}

Statistics statistics_of(uint column) {
    const vec4 some = channels_below(LD4(x, column), 0, dims.channels);
    const float pivot = dims.channels < 4 ? some.x : across(0.25 * some);
    vec2 moments = moments_about(pivot, 1.0, column, first_quad());
    Statistics result = Statistics(pivot, moments.x, moments.y - moments.x * moments.x, 1.0);
    // The pivot is as good as the mean unless it lies far from it, or squares overflow. No barrier is skipped.
    const bool good = finite(moments.y) && moments.x * moments.x <= 4.0 * result.variance;
    const uint begin = good ? dims.channels : first_quad();

    const float about = some.x * kSmall;
    vec4 sum = vec4(0);
    vec4 lowest = vec4(0);
    vec4 highest = vec4(0);
    for (uint q = begin; 4 * q < dims.channels; q += kLanes) {
        const vec4 d = channels_below(LD4(x, q * dims.columns + column) * kSmall - about, 4 * q, dims.channels);
        sum += d;
        lowest = min(lowest, d);
        highest = max(highest, d);
    }
    const vec4 apart = highest - lowest;
    const vec4 all = sum_of_lanes(vec4(across(sum), max(max(apart.x, apart.y), max(apart.z, apart.w)), 0, 0));
    const float unit = all.y > kSquaresFit * kSmall ? kShrink : 1.0;
    const float guess = (about + all.x / float(dims.channels)) * (unit == 1.0 ? 1.0 / kSmall : kShrink / kSmall);
    moments = moments_about(guess, unit, column, begin);
    if (!good) result = Statistics(guess, moments.x, moments.y - moments.x * moments.x, unit);
    return result;
}

void main() {
    const uint own = column_of(dims.groups_x);
    const uint column = min(own, dims.columns - 1);
    const uint quads = (dims.channels + 3) / 4;
    const Statistics of = statistics_of(column);
    const float unit = of.unit;
    const vec2 mean = split_mean(of.guess, of.residual);
    const float rstd = inverse_deviation(of.variance, dims.eps, unit);

    if (own >= dims.columns) return;
    uint q = first_quad();
    for (; q + (kUnroll - 1) * kLanes < dims.channels / 4; q += kUnroll * kLanes)
        [[unroll]] for (uint u = 0; u < kUnroll; ++u) {
            const uint k = q + u * kLanes;
            const uint at = k * dims.columns + column;
            ST4(y, at, LD4(gamma, k) * (((LD4(x, at) * unit - mean.x) - mean.y) * rstd) + LD4(beta, k));
        }
    for (; q < quads; q += kLanes) {
        const uint at = q * dims.columns + column;
        const vec4 t = LD4(gamma, q) * (((LD4(x, at) * unit - mean.x) - mean.y) * rstd) + LD4(beta, q);
        ST4(y, at, channels_below(t, 4 * q, dims.channels));
    }
    if (first_quad() != 0) return;
    mean_out[column] = mean.x * per_unit(unit);
    mean_out[dims.columns + column] = mean.y * per_unit(unit);
    rstd_out[column] = rstd * unit;
}
