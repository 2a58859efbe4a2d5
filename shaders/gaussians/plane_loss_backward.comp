#version 460
// Adds the gradient of the loss of planes: of its terms with the offsets as constants, as the deviations from a mean
// add up to 0. A Gaussian is on one plane at most. One workgroup computes one plane. Bindings: plane_loss.glsl's;
// offsets [planes]; grad_loss [1] quad; grad_gaussians [N,3].
#extension GL_GOOGLE_include_directive : require
#include "params/loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "plane_loss.glsl"
layout(set = 0, binding = 4, std430) readonly buffer Offsets { float offsets[]; };
QUADS(5, grad_loss);
layout(set = 0, binding = 6, std430) buffer GradGaussians { vec4 grad_gaussians[]; };  // accumulates

void main() {
    const uint plane = plane_of_group();
    if (plane >= params.planes) return;
    const uint first = LD1(begins, plane), last = LD1(begins, plane + 1);
    const vec3 normal = LD4(normals, plane).xyz;
    const float offset = offsets[plane], factor = 2 * params.scale * LD4(grad_loss, 0).x;
    for (uint i = first + gl_LocalInvocationID.x; i < last; i += gl_WorkGroupSize.x) {
        const Member m = member_at(i, normal);
        const vec3 thick = factor * m.scale * m.across;
        const uint at = 3 * LD1(members, i);
        grad_gaussians[at].xyz += factor * (dot(normal, m.mean) - offset) * normal;
        grad_gaussians[at + 1].xyz += thick * m.across;
        grad_gaussians[at + 2] += quaternion_backward(m.q, outerProduct(normal, thick * m.scale));
    }
}
