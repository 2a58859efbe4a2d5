#version 460
// One step of Adam on the parameters of Gaussians, with the chain rule of their activations, in place:
//   opacity = 1 / (1 + exp(-logit)), scale = exp(log scale); mean and rotation are parameters themselves.
// Besides, for each view in which pixels saw the Gaussian, the length of its screen gradient, of absolute values, is
// added to statistics.x, and 1 to statistics.y. The pulls are gradients of regularisers.
// One invocation updates one quad: 3 i is mean and logit, 3 i + 1 log scales, 3 i + 2 the rotation of Gaussian i.
// Bindings: raw, set (activated), m, v, grad, exported (of project_backward), statistics [N] vec2; on CPU devices raw,
// set, m, v again, to write; all but statistics quads. Specialisation: kSparse.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "fit/fit_adam.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kFitSparseId) const uint kSparse = 0;
QUADS_IN_PLACE(0, 7, raw);
QUADS_IN_PLACE(1, 8, set);
QUADS_IN_PLACE(2, 9, m);
QUADS_IN_PLACE(3, 10, v);
QUADS(4, grad);
QUADS(5, exported);
layout(set = 0, binding = 6, std430) buffer Statistics { vec2 statistics[]; };  // accumulates
layout(push_constant) uniform Push { FitAdamSetParams params; };

#include "launch.glsl"

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= 3 * params.gaussians) return;
    const uint gaussian = i / 3, role = i - 3 * gaussian;
    vec4 g = LD4(grad, i);
    if (kSparse != 0 && g == vec4(0)) return;
    const vec4 active_value = LD4(set, i);
    vec4 chain = vec4(1), step_size = vec4(params.rotation);
    if (role == 0) {
        chain.w = active_value.w * (1 - active_value.w);
        step_size = vec4(vec3(params.mean), params.logit);
        g.w += params.opacity_pull;
    } else if (role == 1) {
        chain = active_value;
        step_size = vec4(vec3(params.log_scale), 0);
        g.xyz += params.scale_pull;
    }
    vec4 first = LD4(m, i), second = LD4(v, i);
    const vec4 value = LD4(raw, i) - step_size * fit_adam(params.adam, g * chain, first, second);
    vec4 activated = value;
    if (role == 0) activated.w = 1 / (1 + exp(-value.w));
    if (role == 1) activated = vec4(exp(value.xyz), 0);
    ST4_IN_PLACE(raw, i, value);
    ST4_IN_PLACE(set, i, activated);
    ST4_IN_PLACE(m, i, first);
    ST4_IN_PLACE(v, i, second);
    if (role != 0) return;
    vec2 seen = vec2(0);
    for (uint view = 0; view < params.views; ++view) {
        const float norm = length(LD4(exported, 3 * (view * params.gaussians + gaussian)).zw);
        if (norm > 0 && finite(norm)) seen += vec2(norm, 1);
    }
    if (seen.y > 0) statistics[gaussian] += seen;
}
