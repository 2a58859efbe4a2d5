// Gradient of projection.glsl: from the sums of blending, the depth and the opacity to the Gaussian and to the
// camera. Formulas: chain rule over Sigma' = A A^T + kDilation I, rows v1, v2 of A;
// the three quirks of the original 3dgs gradient under kFlagOriginalGradient.

#ifndef SPLAT_PROJECTION_BACKWARD_GLSL
#define SPLAT_PROJECTION_BACKWARD_GLSL

#include "projection.glsl"

// Blending sums over pixels in coordinates in which a Gaussian is round, y = L^T q with q = mean - pixel and
// L L^T the conic: there all sums are of the size of the result, where those of q q^T of a needle cancel.
struct ImageGradient {
    vec2 y;         // sum of v y, v = alpha dL/dalpha of a pixel
    vec3 moments;   // M = sum of v y y^T: xx, xy, yy
    float opacity;  // after compensation
    float depth;
};

struct GaussianGradient {
    vec3 mean;
    vec3 scale;
    mat3 rq;        // gradient of the rotation matrix; column k, row r
    float opacity;
};

struct PoseGradient {
    mat3 rotation;  // column k, row r, as View::rotation
    vec3 translation;
    vec4 intrinsics;  // fx fy cx cy
};

// L^T times matrices of two rows, for A = J R_camera R_q S: dL/dA = L M H with H = L^T A, since
// dL/dSigma' = L M L^T / 2. As c r1 - b r2 = kDilation r1 + (S p2 rotated) x (r1 x r2), no row cancels.
struct Whitened {
    vec3 t1, t2;  // L^T J R_camera
    vec3 e1, e2;  // L^T J R_camera R_q
    vec3 h1, h2;  // H
};

Whitened whitened(Projection p, vec3 scale) {
    const float root_c = sqrt(p.c), root_det = sqrt(p.det);
    Whitened w;
    w.t2 = p.r2 / root_c;
    w.e2 = p.p2 / root_c;
    w.h2 = p.v2 / root_c;
    const vec3 along = scale * w.h2;
    w.t1 = (kDilation / root_c * p.r1 + cross(p.rq * along, cross(p.r1, p.r2))) / root_det;
    w.e1 = (kDilation / root_c * p.p1 + cross(along, p.normal)) / root_det;
    w.h1 = w.e1 * scale;
    return w;
}

// Gradient of the conic A, B, C of sigma = (A dx^2 + C dy^2) / 2 + B dx dy: q = L^-T y.
vec3 conic_gradient(Projection p, vec3 moments) {
    const float root_c = sqrt(p.c);
    const vec2 x = vec2(sqrt(p.det), p.b) / root_c;  // qx = x . y, qy = root_c y.y
    const float xx = x.x * (x.x * moments.x + 2 * x.y * moments.y) + x.y * x.y * moments.z;
    return -vec3(0.5 * xx, root_c * (x.x * moments.y + x.y * moments.z), 0.5 * p.c * moments.z);
}

// Adds the gradient of rho = max(kCompensationMin, sqrt(det0 / det)) to the rows of M H; returns rho.
// dL/dSigma0 is rho grad_rho (Sigma0^-1 - Q) / 2 for Sigma0 = A A^T, thus M is rho grad_rho ((H H^T)^-1 - 1) with
// 1 - H H^T = kDilation L^T L. The rows of (H H^T)^-1 H are those of H times the minors of H, over det H H^T = rho^2.
float compensation_backward(Projection p, Whitened w, float grad_rho, inout vec3 mh1, inout vec3 mh2) {
    const float rho = sqrt(p.det0 / p.det);
    if (!(rho > kCompensationMin)) return kCompensationMin;
    const vec3 l = p.l, minors = p.minors / sqrt(p.det);
    const vec3 n1 = cross(w.h2, minors), n2 = cross(minors, w.h1);
    const float k = kDilation * grad_rho / rho;
    mh1 += k * ((l.x * l.x + l.y * l.y) * n1 + l.y * l.z * n2);
    mh2 += k * (l.y * l.z * n1 + l.z * l.z * n2);
    return rho;
}

// Gradient of the mean in the image.
vec2 mean_gradient(Projection p, vec2 y) { return -vec2(p.l.x * y.x, p.l.y * y.x + p.l.z * y.y); }

void projection_backward(View view, Projection p, vec3 mean, vec3 scale, float opacity, ImageGradient g,
                         uint flags, out GaussianGradient out_gaussian, out PoseGradient out_pose) {
    const Whitened w = whitened(p, scale);
    vec3 moments = g.moments;
    // A factor det^2 / (det^2 + kConicGradMin), without a square that overflows.
    if ((flags & kFlagOriginalGradient) != 0) moments /= 1.0 + kConicGradMin / p.det / p.det;
    // M H, then its product with S.
    vec3 mh1 = moments.x * w.h1 + moments.y * w.h2, mh2 = moments.y * w.h1 + moments.z * w.h2;
    out_gaussian.opacity = g.opacity;
    if ((flags & kFlagAntialias) != 0)
        out_gaussian.opacity *= compensation_backward(p, w, g.opacity * opacity, mh1, mh2);
    const vec3 by_p1 = mh1 * scale, by_p2 = mh2 * scale;
    out_gaussian.scale = w.e1 * mh1 + w.e2 * mh2;
    out_gaussian.rq = outerProduct(w.t1, by_p1) + outerProduct(w.t2, by_p2);
    const vec3 by_t1 = p.rq * by_p1, by_t2 = p.rq * by_p2;
    const vec3 grad_r1 = p.l.x * by_t1, grad_r2 = p.l.y * by_t1 + p.l.z * by_t2;

    const vec3 w2 = vec3(view.rotation[0][2], view.rotation[1][2], view.rotation[2][2]);
    const float iz = 1.0 / p.m.z;
    const vec2 f = view.intrinsics.xy * iz;
    const vec2 inside = p.t * iz;
    const vec2 by_mean = mean_gradient(p, g.y);
    // r1 = f (w0 - inside w2): gradient of f, which falls as 1 / z, and of inside = x / z unless clamped.
    const vec2 by_w2 = vec2(dot(grad_r1, w2), dot(grad_r2, w2));
    const float by_f = dot(w.h1, mh1) + dot(w.h2, mh2);  // sum of f dL/df
    const vec2 by_inside = mix(-f * by_w2, vec2(0), p.clamped);
    vec3 grad_m;
    grad_m.xy = iz * by_inside + f * by_mean;
    grad_m.z = g.depth - iz * (by_f + dot(inside, by_inside) + dot(f * p.m.xy, by_mean));
    if ((flags & kFlagOriginalGradient) != 0)
        grad_m.z += iz * dot(mix(vec2(0), f * inside, p.clamped), by_w2);

    out_gaussian.mean = grad_m * view.rotation;
    out_pose.translation = grad_m;
    mat3 rows;  // rows[r] = gradient of row r of the rotation
    rows[0] = grad_m.x * mean + f.x * grad_r1;
    rows[1] = grad_m.y * mean + f.y * grad_r2;
    rows[2] = grad_m.z * mean - f.x * inside.x * grad_r1 - f.y * inside.y * grad_r2;
    out_pose.rotation = transpose(rows);
    // f of the mean and of r1; a clamped x / z is (k - cx) / fx in gsplat's convention and k / fx in 3dgs's.
    const vec2 own = vec2(dot(p.r1, grad_r1), dot(p.r2, grad_r2)) / view.intrinsics.xy;
    const vec2 by_limit = mix(vec2(0), iz * by_w2, p.clamped);
    out_pose.intrinsics.xy = own + iz * p.m.xy * by_mean + inside * by_limit;
    out_pose.intrinsics.zw = by_mean + ((flags & kFlagGsplat) != 0 ? by_limit : vec2(0));
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
