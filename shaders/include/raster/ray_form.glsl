// A Gaussian as the rays of pixels see it, for the convention ray_maximum: opacity at the maximum along the ray.
//
// With Sigma = B^T B, B = S R_q^T R_camera^T (columns b_x, b_y, b_z; S^2 = scale^2 + kRayVariance), the mean m = z r0
// and the ray t r of a pixel, r = r0 + (d, 0), the least Mahalanobis distance along the ray and its depth are
//
//   D^2 = n^T Sigma n / (r^T adj(Sigma) r), n = r x m = z (d_y, -d_x, d_x r0_y - d_y r0_x)
//   t = z (r^T adj(Sigma) r0) / (r^T adj(Sigma) r)
//
// C - B^2 / 4A of the quadratic form along the ray (Yu et al. 2024, Gaussian Opacity Fields, arXiv:2404.10772) is the
// same, but cancels for what is small and far. Numerator and denominator are sums of squares by Cholesky factors, in
// which n is linear in d: D^2 = ((l11 d_x + l21 d_y)^2 + (l22 d_y)^2) / (e1^2 + e2^2 + 1).

#ifndef SPLAT_RAY_FORM_GLSL
#define SPLAT_RAY_FORM_GLSL

#include "finite.glsl"
#include "projection.glsl"

// Margins of the box: of its extent, and of the mean's place, for rounding.
const float kRayMargin = 1e-3;
const float kRayMeanMargin = 4e-6;
const float kRayEverywhere = 1e30;

struct RayForm {
    vec4 l;    // l11, l21, l22, f22 per pixel; l of D^2 / 2 in log2 units
    vec4 e;    // e1, e2 at the mean, f11, f12 per pixel
    vec4 seen;  // least x, y, greatest x, y of the pixels that see it
    vec4 box;   // the same with a margin for rounding
};

// Bounds of the slope less r0 in one axis of the ellipsoid D^2 <= level beyond the near plane; lengths are in depths of
// the mean. kappa: n^T Sigma n is |kappa - slope b_z|^2 for the plane through the camera with that slope; side:
// |kappa x b_z|. A bound is where such a plane touches the ellipsoid, or, if that is before the near plane, the end of
// the ellipse in it.
vec2 slopes(float level, float near, vec3 kappa, float side, vec3 bz) {
    const float zz = dot(bz, bz), along = dot(kappa, bz), gap = near - 1.0;
    const bool cut = level * zz > gap * gap;  // the mean is beyond the plane
    const float half_width = sqrt(max(level - gap * gap / zz, 0.0)) * side / sqrt(zz);
    vec2 found = cut ? (along / zz * gap + vec2(-half_width, half_width)) / near : vec2(0);
    const float a = 1.0 - level * zz, b = level * along, c = level * dot(kappa, kappa);
    // b^2 + a c, and the depths 1 + level (along - slope zz) / slope where planes touch, which cancel for what is
    // large.
    const float root = c - level * side * (level * side);
    if (!(root >= 0.0)) return found;
    const float s = b >= 0.0 ? sqrt(root) : -sqrt(root), q = -b - s;
    const vec2 touching = vec2(q / a, -c / q);
    const vec2 depths = vec2(-s, s) / touching;
    [[unroll]] for (int i = 0; i < 2; ++i) {
        const float slope = touching[i];
        if (cut && !(depths[i] >= near)) continue;
        if (slope > 0.0) found.y = slope;
        else found.x = slope;
    }
    return found;
}

// reach: log2 units.
RayForm ray_form(View view, Projection p, vec3 scale, vec2 mean, float reach, float near) {
    const vec3 deviation = sqrt(scale * scale + kRayVariance);
    const float largest = max(deviation.x, max(deviation.y, deviation.z));
    const vec3 s = deviation / largest, pairs = s.yzx * s.zxy;
    const mat3 rows = transpose(view.rotation * p.rq);  // columns: rows of R_camera R_q
    const vec3 bx = s * rows[0], by = s * rows[1], bz = s * rows[2];
    const vec3 normal = cross(rows[0], rows[1]);
    // Columns of a matrix whose squares are adj(Sigma); of bx, by and bz, which needles make nearly parallel, the
    // products would cancel.
    const vec3 wx = pairs * cross(rows[1], rows[2]), wy = pairs * cross(rows[2], rows[0]), wz = pairs * normal;
    const float z = p.m.z;
    const vec2 r0 = p.m.xy / z, focal = view.intrinsics.xy;
    const vec3 w0 = wx * r0.x + wy * r0.y + wz;
    const vec3 kx = bx - r0.x * bz, ky = by - r0.y * bz;
    const float determinant = pairs.x * s.x * dot(normal, rows[2]);
    const float root_z = length(bz), root_x = length(wx), root_k = length(ky);
    const float unit = root_z / determinant, gain = kRootHalfLog2e * z * unit / largest;
    RayForm f;
    f.l = vec4(root_k, -dot(kx, ky) / root_k, length(w0) / root_k, root_z * root_z / root_x) *
          vec4(gain / focal.x, gain / focal.y, gain / focal.y, 1 / focal.y);
    f.e = vec4(dot(wx, w0) / root_x * unit, -dot(bz, ky) / root_x,
               root_x * unit / focal.x, dot(wx, wy) / root_x * unit / focal.y);
    const float size = largest / (kRootHalfLog2e * z), level = reach * size * size;
    const vec2 x = slopes(level, near / z, kx, length(wy), bz) * focal.x;
    const vec2 y = slopes(level, near / z, ky, root_x, bz) * focal.y;
    const vec4 extent = vec4(x.x, y.x, x.y, y.y);
    const vec4 margin = kRayMargin * (abs(extent) + 1.0) + kRayMeanMargin * abs(mean.xyxy);
    const vec4 outwards = vec4(-1, -1, 1, 1);
    f.seen = mean.xyxy + extent;
    if (!finite(f.seen)) f.seen = outwards * kRayEverywhere;
    f.box = f.seen + outwards * (finite(margin) ? margin : vec4(0));
    return f;
}

#endif
