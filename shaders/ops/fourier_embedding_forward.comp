#version 460
// Each feature s of x becomes 2W values: cos(2 pi s f_j), j < W, then sin(2 pi s f_j).
// One invocation computes one quad of y. Bindings: x quads [F/4][rows] (read by component), frequencies
// [W], y quads [2F*W/4][rows].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/fourier_embedding_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Frequencies { float frequencies[]; };
layout(set = 0, binding = 2, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { FourierEmbeddingParams params; };

#include "launch.glsl"
#include "sincos.glsl"

float value_of(uint channel, uint row) {
    const uint feature = channel / (2 * params.waves);
    const uint place = channel % (2 * params.waves);
    const vec2 both = sincos_turns(x[(feature / 4 * params.rows + row) * 4 + feature % 4],
                                   frequencies[place % params.waves]);
    return place < params.waves ? both.y : both.x;
}

void main() {
    const uint channels = 2 * params.features * params.waves;
    const uint i = invocation_index(params.groups_x);
    if (i >= (channels + 3) / 4 * params.rows) return;
    const uint first = 4 * (i / params.rows);
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k)
        if (first + k < channels) value[k] = value_of(first + k, i % params.rows);
    y[i] = value;
}
