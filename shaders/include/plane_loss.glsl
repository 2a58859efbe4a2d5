// Gaussians by their planes: what the passes of the loss of planes share.

#ifndef SPLAT_PLANE_LOSS_GLSL
#define SPLAT_PLANE_LOSS_GLSL

#include "load.glsl"
#include "params/loss_params.h"
#include "projection_backward.glsl"

QUADS(0, gaussians);
UINTS(1, members);  // numbers of Gaussians, plane after plane
UINTS(2, begins);   // [planes + 1] first member of each plane
QUADS(3, normals);
layout(push_constant) uniform Push { PlaneLossParams params; };

uint plane_of_group() { return gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x; }

struct Member {
    vec3 mean, scale;
    vec4 q;
    vec3 across;  // cosines between the plane's normal and the Gaussian's axes
};

Member member_at(uint place, vec3 normal) {
    const uint at = 3 * LD1(members, place);
    Member m;
    m.mean = LD4(gaussians, at).xyz;
    m.scale = LD4(gaussians, at + 1).xyz;
    m.q = LD4(gaussians, at + 2);
    m.across = normal * quaternion_matrix(m.q);
    return m;
}

#endif
