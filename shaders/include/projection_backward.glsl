// Gradient of projection.glsl: from the conic, the mean in the image, the depth and the opacity to the
// Gaussian and to the camera. Formulas: chain rule over Sigma' = A A^T + kDilation I, rows v1, v2 of A;
// the three quirks of the original 3dgs gradient under kFlagOriginalGradient.

#ifndef SPLAT_PROJECTION_BACKWARD_GLSL
#define SPLAT_PROJECTION_BACKWARD_GLSL

#include "projection.glsl"

struct ImageGradient {
    vec2 mean;
    vec3 conic;     // A, B, C of sigma = (A dx^2 + C dy^2) / 2 + B dx dy
    float opacity;  // after compensation
    float depth;
};

struct GaussianGradient {
    vec3 mean;
    vec3 scale;
    mat3 rq;        // of the rotation matrix; column k, row r
    float opacity;
};

struct PoseGradient {
    mat3 rotation;  // column k, row r, as View::rotation
    vec3 translation;
};

// Gradient of the rows v1 and v2 of A: dL/dA = -2 Q Gq (Q A), Q the conic and Gq = (g_A, g_B / 2;
// g_B / 2, g_C). The rows of Q A, with n = v1 x v2, are free of the cancellation of needles:
//   y1 = (kDilation v1 + v2 x n) / det,  y2 = (kDilation v2 + n x v1) / det
struct RowsGradient {
    vec3 v1, v2;
};

RowsGradient rows_backward(Projection p, vec3 g, uint flags) {
    const vec3 n = cross(p.v1, p.v2);
    const vec3 y1 = (kDilation * p.v1 + cross(p.v2, n)) / p.det;
    const vec3 y2 = (kDilation * p.v2 + cross(n, p.v1)) / p.det;
    const vec3 t1 = g.x * y1 + 0.5 * g.y * y2, t2 = 0.5 * g.y * y1 + g.z * y2;
    RowsGradient rows;
    rows.v1 = -2 / p.det * (p.c * t1 - p.b * t2);
    rows.v2 = -2 / p.det * (p.a * t2 - p.b * t1);
    if ((flags & kFlagOriginalGradient) != 0) {
        const float factor = p.det * p.det / (p.det * p.det + kConicGradMin);
        rows.v1 *= factor;
        rows.v2 *= factor;
    }
    return rows;
}

// Adds the gradient of rho = max(kCompensationMin, sqrt(det0 / det)); returns rho.
// d det0/dv1 = 2 v2 x n and d det/dv1 = 2 det y1.
float compensation_backward(Projection p, float grad_rho, inout RowsGradient rows) {
    const float rho = sqrt(p.det0 / p.det);
    if (!(rho > kCompensationMin)) return kCompensationMin;
    const vec3 n = cross(p.v1, p.v2);
    const vec3 n1 = cross(p.v2, n), n2 = cross(n, p.v1);
    const float k0 = grad_rho / (rho * p.det), k = grad_rho * rho / p.det;
    rows.v1 += k0 * n1 - k * (kDilation * p.v1 + n1);
    rows.v2 += k0 * n2 - k * (kDilation * p.v2 + n2);
    return rho;
}

void projection_backward(View view, Projection p, vec3 mean, vec3 scale, float opacity, ImageGradient g,
                         uint flags, out GaussianGradient out_gaussian, out PoseGradient out_pose) {
    RowsGradient rows_gradient = rows_backward(p, g.conic, flags);
    out_gaussian.opacity = g.opacity;
    if ((flags & kFlagAntialias) != 0)
        out_gaussian.opacity *= compensation_backward(p, g.opacity * opacity, rows_gradient);

    const vec3 grad_v1 = rows_gradient.v1, grad_v2 = rows_gradient.v2;
    out_gaussian.scale = grad_v1 * (p.r1 * p.rq) + grad_v2 * (p.r2 * p.rq);
    const vec3 grad_p1 = grad_v1 * scale, grad_p2 = grad_v2 * scale;
    out_gaussian.rq = outerProduct(p.r1, grad_p1) + outerProduct(p.r2, grad_p2);
    const vec3 grad_r1 = p.rq * grad_p1, grad_r2 = p.rq * grad_p2;

    const vec3 w2 = vec3(view.rotation[0][2], view.rotation[1][2], view.rotation[2][2]);
    const float iz = 1.0 / p.m.z;
    const vec2 f = view.intrinsics.xy * iz;
    const vec2 inside = p.t * iz;
    // r1 = f (w0 - inside w2): gradient of f, which falls as 1 / z, and of inside = x / z unless clamped.
    const vec2 by_w2 = vec2(dot(grad_r1, w2), dot(grad_r2, w2));
    const vec2 by_f = vec2(dot(grad_r1, p.r1), dot(grad_r2, p.r2)) / f;
    const vec2 by_inside = mix(-f * by_w2, vec2(0), p.clamped);
    vec3 grad_m;
    grad_m.xy = iz * by_inside + f * g.mean;
    grad_m.z = g.depth - iz * (dot(f, by_f) + dot(inside, by_inside) + dot(f * p.m.xy, g.mean));
    if ((flags & kFlagOriginalGradient) != 0)
        grad_m.z += iz * dot(mix(vec2(0), f * inside, p.clamped), by_w2);

    out_gaussian.mean = grad_m * view.rotation;
    out_pose.translation = grad_m;
    mat3 rows;  // rows[r] = gradient of row r of the rotation
    rows[0] = grad_m.x * mean + f.x * grad_r1;
    rows[1] = grad_m.y * mean + f.y * grad_r2;
    rows[2] = grad_m.z * mean - f.x * inside.x * grad_r1 - f.y * inside.y * grad_r2;
    out_pose.rotation = transpose(rows);
}

// Gradient of the quaternion w, x, y, z, through the matrix of quaternion_matrix().
vec4 quaternion_backward(vec4 q, mat3 g) {
    const float w = q.x, x = q.y, y = q.z, z = q.w;
    const float g00 = g[0][0], g11 = g[1][1], g22 = g[2][2];
    const vec3 odd = vec3(g[1][2] - g[2][1], g[2][0] - g[0][2], g[0][1] - g[1][0]);
    const float xy = g[0][1] + g[1][0], xz = g[0][2] + g[2][0], yz = g[1][2] + g[2][1];
    return 2 * vec4(dot(q.yzw, odd),
                    y * xy + z * xz + w * odd.x - 2 * x * (g11 + g22),
                    x * xy + z * yz + w * odd.y - 2 * y * (g00 + g22),
                    x * xz + y * yz + w * odd.z - 2 * z * (g00 + g11));
}

#endif
