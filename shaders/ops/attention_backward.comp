#version 460
// Backward of the softmax: grad_scores[k][n] = scale * w[k][n] (grad_w[k][n] - sum_k w grad_w).
// One invocation computes one query. Bindings: weights, grad_weights, grad_scores, all quads [k/4][n];
// grad_scores may be the memory of grad_weights.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, weights);
QUADS(1, grad_weights);
QUADS_OUT(2, grad_scores);
layout(push_constant) uniform Push { AttentionParams params; };

void main() {
    const uint query = gl_GlobalInvocationID.x;
    if (query >= params.n) return;
    const uint quads = (params.k + 3) / 4;
    const uint at = gl_WorkGroupID.z * quads * params.n + query;
    vec4 sums = vec4(0);
    for (uint q = 0; q < quads; ++q)
        sums += LD4(weights, at + q * params.n) * LD4(grad_weights, at + q * params.n);
    const float mean = (sums.x + sums.y) + (sums.z + sums.w);
    for (uint q = 0; q < quads; ++q)
        ST4(grad_scores, at + q * params.n,
            params.scale * LD4(weights, at + q * params.n) * (LD4(grad_weights, at + q * params.n) - mean));
}
