#version 460
// grad_x[s] = sum_j f_j (cos(s f_j) grad_sin_j - sin(s f_j) grad_cos_j).
// One invocation computes one quad of grad_x. Bindings: x quads [F/4][rows], grad_y quads
// [F*D/4][rows], grad_x quads; x and grad_y are read by component.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/positional_embedding_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 2, std430) writeonly buffer GradX { vec4 grad_x[]; };
layout(push_constant) uniform Push { PositionalEmbeddingParams params; };

#include "launch.glsl"
#include "sincos.glsl"

float grad_of(uint channel, uint row) {
    const uint channels = params.features * params.dimension;
    const uint from = params.swap != 0 ? (channel + channels / 2) % channels : channel;
    return grad_y[(from / 4 * params.rows + row) * 4 + from % 4];
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.features + 3) / 4 * params.rows) return;
    const uint row = i % params.rows;
    const uint waves = params.dimension / 2;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint feature = 4 * (i / params.rows) + k;
        if (feature >= params.features) continue;
        float frequency = 1;
        for (uint j = 0; j < waves; ++j) {
            const vec2 both = sincos(x[i * 4 + k] * frequency);
            const uint channel = feature * params.dimension + j;
            value[k] += frequency * (both.y * grad_of(channel + waves, row) - both.x * grad_of(channel, row));
            frequency *= params.ratio;
        }
    }
    grad_x[i] = value;
}
