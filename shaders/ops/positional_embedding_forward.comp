#version 460
// Each feature s of x becomes D values: cos(s f_j), j < D/2, then sin(s f_j), f_j = ratio^j.
// One invocation computes one quad of y. Bindings: x quads [F/4][rows] (read by component), y quads
// [F*D/4][rows].
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/positional_embedding_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Y { vec4 y[]; };
layout(push_constant) uniform Push { PositionalEmbeddingParams params; };

#include "launch.glsl"
#include "sincos.glsl"

float value_of(uint channel, uint row) {
    const uint feature = channel / params.dimension;
    const uint place = channel % params.dimension;
    const uint waves = params.dimension / 2;
    float frequency = 1;
    for (uint j = 0; j < place % waves; ++j) frequency *= params.ratio;
    const vec2 both = sincos(x[(feature / 4 * params.rows + row) * 4 + feature % 4] * frequency);
    return place < waves ? both.y : both.x;
}

void main() {
    const uint channels = params.features * params.dimension;
    const uint i = invocation_index(params.groups_x);
    if (i >= (channels + 3) / 4 * params.rows) return;
    const uint first = 4 * (i / params.rows);
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint channel = first + k;
        if (channel < channels)
            value[k] = value_of(params.swap != 0 ? (channel + channels / 2) % channels : channel, i % params.rows);
    }
    y[i] = value;
}
