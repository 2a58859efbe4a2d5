#version 460
// Halves of Gaussians that are split along their longest axis, and the activated set of all. A half lies half a
// standard deviation from the whole's mean; its longest scale is half of the whole's, the other two are 0.85 of them,
// and its opacity is 0.6 of it. Factors were measured on posed photographs. A share has the logit that the host gives,
// and scales changed by a factor.
// One invocation computes one Gaussian. Bindings: raw [N,3] quads, changes [N,3] uint32 (kFitKeep or another role, and
// the bits of a share's logit and logarithm of its factor); raw and the activated set [N,3] quads to write.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "fit/rotate.glsl"
#include "params/fit_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, raw);
UINTS(1, changes);
QUADS_OUT(2, raw_out);
QUADS_OUT(3, set_out);
layout(push_constant) uniform Push { FitSplitParams params; };

#include "launch.glsl"

const float kLongest = -0.693147181;  // log 0.5
const float kOthers = -0.162518929;   // log 0.85

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.gaussians) return;
    vec4 mean = LD4(raw, 3 * i), scale = LD4(raw, 3 * i + 1);
    const vec4 q = LD4(raw, 3 * i + 2);
    const uint role = LD1(changes, 3 * i);
    if (role == kFitFirstHalf || role == kFitSecondHalf) {
        const uint longest = scale.x >= scale.y && scale.x >= scale.z ? 0 : scale.y >= scale.z ? 1 : 2;
        const vec3 one = vec3(longest == 0, longest == 1, longest == 2);
        const float side = role == kFitFirstHalf ? 0.5 : -0.5;
        mean.xyz += side * exp(dot(one, scale.xyz)) * rotate(q / length(q), one);
        scale.xyz += mix(vec3(kOthers), vec3(kLongest), one);
        const float opacity = clamp(0.6 / (1 + exp(-mean.w)), 1e-4, 0.99);
        mean.w = log(opacity / (1 - opacity));
    } else if (role == kFitShare) {
        mean.w = uintBitsToFloat(LD1(changes, 3 * i + 1));
        scale.xyz += uintBitsToFloat(LD1(changes, 3 * i + 2));
    }
    ST4(raw_out, 3 * i, mean);
    ST4(raw_out, 3 * i + 1, scale);
    ST4(raw_out, 3 * i + 2, q);
    ST4(set_out, 3 * i, vec4(mean.xyz, 1 / (1 + exp(-mean.w))));
    ST4(set_out, 3 * i + 1, vec4(exp(scale.xyz), 0));
    ST4(set_out, 3 * i + 2, q);
}
