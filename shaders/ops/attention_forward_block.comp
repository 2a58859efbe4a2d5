#version 460
// Softmax over the keys without its quotient: weights[k][n] = exp(s[k][n] - max) for each query n, zero for the missing
// keys of the last quad, and factors[n], a quad of 1 / sum, which the product with the values takes.
// One invocation computes one query. Bindings: scores quads [k/4][n], weights quads [k/4][n] (may be the same memory:
// an element is written after its last read), factors.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/attention_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, scores);
QUADS_OUT(1, weights);
QUADS_OUT(2, factors);
layout(push_constant) uniform Push { AttentionParams params; };

const float kLowest = -3.402823466e38;

bvec4 keys_of(uint quad) { return lessThan(4 * quad + uvec4(0, 1, 2, 3), uvec4(params.k)); }

void main() {
    const uint query = gl_GlobalInvocationID.x;
    if (query >= params.n) return;
    const uint whole = params.k / 4;
    const uint quads = (params.k + 3) / 4;
    const uint at = gl_WorkGroupID.z * quads * params.n + query;
    vec4 greatest = vec4(kLowest);
    for (uint q = 0; q < whole; ++q) greatest = max(greatest, LD4(scores, at + q * params.n));
    if (whole < quads)
        greatest = max(greatest, mix(vec4(kLowest), LD4(scores, at + whole * params.n), keys_of(whole)));
    const float top = max(max(greatest.x, greatest.y), max(greatest.z, greatest.w));
    vec4 sums = vec4(0);
    for (uint q = 0; q < whole; ++q) {
        const vec4 weight = exp(LD4(scores, at + q * params.n) - top);
        sums += weight;
        ST4(weights, at + q * params.n, weight);
    }
    if (whole < quads) {
        const vec4 weight = mix(vec4(0), exp(LD4(scores, at + whole * params.n) - top), keys_of(whole));
        sums += weight;
        ST4(weights, at + whole * params.n, weight);
    }
    ST4(factors, gl_WorkGroupID.z * params.n + query, vec4(1.0 / ((sums.x + sums.y) + (sums.z + sums.w))));
}
