#version 460
// grad_beta[n][c] = sum_p grad_y, grad_gamma[n][c] = sum_p grad_y * x, in the layout of the
// modulation: [n, 2c] gamma then beta, or [n, c] beta alone.
// One workgroup computes one quad of channels of one image.
// Bindings: x quads, grad_y quads, grad_modulation quads (written by component).
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/film_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, x);
QUADS(1, grad_y);
layout(set = 0, binding = 2, std430) writeonly buffer Grad { float grad_modulation[]; };
layout(push_constant) uniform Push { FilmParams params; };

#include "reduce.glsl"

void put(uint channel, uint n, float value) {
    grad_modulation[(channel / 4 * params.n + n) * 4 + channel % 4] = value;
}

void main() {
    const uint n = gl_WorkGroupID.y;
    const uint quad = gl_WorkGroupID.x;
    const uint lane = gl_LocalInvocationID.x;
    const uint at = (quad * params.n + n) * params.p;
    vec4 beta = vec4(0);
    vec4 gamma = vec4(0);
    for (uint p = lane; p < params.p; p += gl_WorkGroupSize.x) {
        const vec4 grad = LD4(grad_y, at + p);
        beta += grad;
        gamma += grad * LD4(x, at + p);
    }
    beta = workgroup_sum(beta);
    gamma = workgroup_sum(gamma);
    const uint c = 4 * quad + lane;
    const uint channels = params.shift != 0 ? params.c : 2 * params.c;
    if (lane < 4 && c < params.c) {
        put(channels - params.c + c, n, beta[lane]);
        if (params.shift == 0) put(c, n, gamma[lane]);
    }
    // The last quad's missing channels are zero by convention.
    if (quad == 0 && lane < 4 && channels + lane < (channels + 3) / 4 * 4) put(channels + lane, n, 0);
}
