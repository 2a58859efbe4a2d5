// Projection of a 3D Gaussian into a camera, for the forward and the backward pass.
//
// Sigma' = A A^T + kDilation I with A = J R_camera R_q S (2 x 3, rows v1 and v2), so that by
// Cauchy-Binet det = |v1 x v2|^2 + kDilation (a0 + c0) + kDilation^2, a sum of terms >= 0, where
// a c - b^2 cancels for needles. The minors v1 x v2 are those of J R_camera R_q times two scales each; of
// v1 and v2 themselves, which needles make nearly parallel, they would cancel. Zwicker et al. 2002, EWA
// splatting; Kerbl et al. 2023.

#ifndef SPLAT_PROJECTION_GLSL
#define SPLAT_PROJECTION_GLSL

#include "norms/quaternion.glsl"
#include "params/project_params.h"
#include "raster_constants.h"
#include "table.glsl"

struct View {
    mat3 rotation;     // world to camera
    vec3 translation;
    vec4 intrinsics;   // fx fy cx cy
    vec4 limits;       // least and greatest x/z, least and greatest y/z of the Jacobian
    vec3 position;     // camera's position in the world
};

const uint kViewQuads = 6;

// sqrt(log2(e) / 2): exp(-sigma) = exp2(-|L^T q|^2) if L is scaled by it.
const float kRootHalfLog2e = 0.849321800288;

// Needs TABLE(..., cameras).
#define LOAD_VIEW(view, cameras, index)                                             \
    {                                                                               \
        const uint at = (index) * kViewQuads;                                       \
        const vec4 row0 = TABLE4(cameras, at), row1 = TABLE4(cameras, at + 1);      \
        const vec4 row2 = TABLE4(cameras, at + 2);                                  \
        view.rotation = transpose(mat3(row0.xyz, row1.xyz, row2.xyz));              \
        view.translation = vec3(row0.w, row1.w, row2.w);                            \
        view.intrinsics = TABLE4(cameras, at + 3);                                  \
        view.limits = TABLE4(cameras, at + 4);                                      \
        view.position = TABLE4(cameras, at + 5).xyz;                                \
    }

struct Projection {
    vec3 m;         // mean in the camera
    vec2 t;         // m.xy, clamped for the Jacobian
    bvec2 clamped;
    mat3 rq;        // rotation of the Gaussian
    vec3 r1, r2;    // rows of J R_camera
    vec3 p1, p2;    // rows of J R_camera R_q
    vec3 v1, v2;
    vec3 normal;    // p1 x p2
    vec3 minors;    // v1 x v2
    float a, b, c;  // Sigma', dilated
    float det0, det;
    vec3 l;         // Cholesky factor of the conic: l11 = sqrt(c / det), l21 = -b / sqrt(c det), l22 = 1 / sqrt(c)
};

// Rotation matrix of w, x, y, z, by the formula for a unit quaternion.
mat3 quaternion_matrix(vec4 q) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    return mat3(1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y),
                2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x),
                2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y));
}

// q is normalised if the convention requires it.
Projection project(View view, vec3 mean, vec3 scale, vec4 q) {
    Projection p;
    p.m = view.rotation * mean + view.translation;
    const float iz = 1.0 / p.m.z;
    const vec2 ratio = p.m.xy * iz;
    const vec2 inside = clamp(ratio, view.limits.xz, view.limits.yw);
    p.clamped = notEqual(ratio, inside);
    p.t = inside * p.m.z;
    const vec3 w0 = vec3(view.rotation[0][0], view.rotation[1][0], view.rotation[2][0]);
    const vec3 w1 = vec3(view.rotation[0][1], view.rotation[1][1], view.rotation[2][1]);
    const vec3 w2 = vec3(view.rotation[0][2], view.rotation[1][2], view.rotation[2][2]);
    p.r1 = view.intrinsics.x * iz * (w0 - inside.x * w2);
    p.r2 = view.intrinsics.y * iz * (w1 - inside.y * w2);
    p.rq = quaternion_matrix(q);
    p.p1 = p.r1 * p.rq;
    p.p2 = p.r2 * p.rq;
    p.v1 = p.p1 * scale;
    p.v2 = p.p2 * scale;
    const float a0 = dot(p.v1, p.v1), c0 = dot(p.v2, p.v2);
    p.normal = cross(p.p1, p.p2);
    p.minors = (p.normal * scale.yzx) * scale.zxy;
    p.det0 = dot(p.minors, p.minors);
    p.det = p.det0 + kDilation * (a0 + c0) + kDilation * kDilation;
    p.a = a0 + kDilation;
    p.b = dot(p.v1, p.v2);
    p.c = c0 + kDilation;
    const float root_c = sqrt(p.c), root_det = sqrt(p.det);
    p.l = vec3(root_c / root_det, -p.b / (root_c * root_det), 1.0 / root_c);
    return p;
}

#endif
