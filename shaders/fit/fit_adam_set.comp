#version 460
// One step of Adam on the parameters of Gaussians, with the chain rule of their activations, in place:
//   opacity = 1 / (1 + exp(-logit)), scale = exp(log scale); mean and rotation are parameters themselves.
// Besides, for each view in which pixels saw the Gaussian, the length of its screen gradient, of absolute values, is
// added to statistics.x, and 1 to statistics.y. The pulls are gradients of regularisers.
// One invocation updates one quad: 3 i is mean and logit, 3 i + 1 log scales, 3 i + 2 the rotation of Gaussian i.
// Bindings: raw, set (activated), grad, m, v, exported (of project_backward), statistics [N] vec2; and raw, set, m, v
// to write; all but statistics quads. Specialisation: kSparse.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "fit/fit_adam.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kFitSparseId) const uint kSparse = 0;
QUADS(0, raw);
QUADS(1, set);
QUADS(2, grad);
QUADS(3, m);
QUADS(4, v);
QUADS(5, exported);
layout(set = 0, binding = 6, std430) buffer Statistics { vec2 statistics[]; };  // accumulates
QUADS_OUT(7, raw_out);
QUADS_OUT(8, set_out);
QUADS_OUT(9, m_out);
QUADS_OUT(10, v_out);
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
    ST4(raw_out, i, value);
    ST4(set_out, i, activated);
    ST4(m_out, i, first);
    ST4(v_out, i, second);
    if (role != 0) return;
    vec2 seen = vec2(0);
    for (uint view = 0; view < params.views; ++view) {
        const float norm = length(LD4(exported, 3 * (view * params.gaussians + gaussian)).zw);
        if (norm > 0 && finite(norm)) seen += vec2(norm, 1);
    }
    if (seen.y > 0) statistics[gaussian] += seen;
}
