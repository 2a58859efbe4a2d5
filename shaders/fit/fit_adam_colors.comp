#version 460
// One step of Adam on the spherical harmonics of Gaussians up to the active degree, in place; the constant term has a
// rate of its own.
// One invocation updates one active quad of one Gaussian.
// Bindings: colors, grad, m, v, and again colors, m, v to write; all quads.
// Specialisation: kColorQuads of a Gaussian, kActiveQuads of them, kSparse.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "fit/fit_adam.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kFitColorQuadsId) const uint kColorQuads = 12;
layout(constant_id = kFitActiveQuadsId) const uint kActiveQuads = 12;
layout(constant_id = kFitSparseId) const uint kSparse = 0;
QUADS(0, colors);
QUADS(1, grad);
QUADS(2, m);
QUADS(3, v);
QUADS_OUT(4, colors_out);
QUADS_OUT(5, m_out);
QUADS_OUT(6, v_out);
layout(push_constant) uniform Push { FitAdamColorsParams params; };

#include "launch.glsl"

void main() {
    const uint active_quad = invocation_index(params.groups_x);
    if (active_quad >= params.quads) return;
    const uint gaussian = active_quad / kActiveQuads, quad = active_quad - gaussian * kActiveQuads;
    const uint i = gaussian * kColorQuads + quad;
    const vec4 g = LD4(grad, i);
    if (kSparse != 0 && g == vec4(0)) return;
    const vec4 step_size = quad == 0 ? vec4(vec3(params.constant), params.rest) : vec4(params.rest);
    vec4 first = LD4(m, i), second = LD4(v, i);
    ST4(colors_out, i, LD4(colors, i) - step_size * fit_adam(params.adam, g, first, second));
    ST4(m_out, i, first);
    ST4(v_out, i, second);
}
