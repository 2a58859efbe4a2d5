#version 460
// grad_x[s] = sum_j 2 pi f_j (cos(2 pi s f_j) grad_sin_j - sin(2 pi s f_j) grad_cos_j).
// One invocation computes one quad of grad_x. Bindings: x quads [F/4][rows], frequencies [W], grad_y quads
// [2F*W/4][rows], grad_x quads; x and grad_y are read by component.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/fourier_embedding_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(set = 0, binding = 0, std430) readonly buffer X { float x[]; };
layout(set = 0, binding = 1, std430) readonly buffer Frequencies { float frequencies[]; };
layout(set = 0, binding = 2, std430) readonly buffer GradY { float grad_y[]; };
layout(set = 0, binding = 3, std430) writeonly buffer GradX { vec4 grad_x[]; };
layout(push_constant) uniform Push { FourierEmbeddingParams params; };

#include "launch.glsl"
#include "sincos.glsl"

float grad_of(uint channel, uint row) {
    return grad_y[(channel / 4 * params.rows + row) * 4 + channel % 4];
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= (params.features + 3) / 4 * params.rows) return;
    const uint row = i % params.rows;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const uint feature = 4 * (i / params.rows) + k;
        if (feature >= params.features) continue;
        for (uint j = 0; j < params.waves; ++j) {
            const vec2 both = sincos_turns(x[i * 4 + k], frequencies[j]);
            const uint channel = 2 * feature * params.waves + j;
            value[k] += 6.28318530717958648 * frequencies[j] *
                        (both.y * grad_of(channel + params.waves, row) - both.x * grad_of(channel, row));
        }
    }
    grad_x[i] = value;
}
