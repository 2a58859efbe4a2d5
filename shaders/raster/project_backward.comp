#version 460
// Sums each Gaussian's records of blending's backward pass in their fixed order, and carries the
// gradient back through projection.glsl and the spherical harmonics, over all views.
// One invocation computes one Gaussian; with kFlagRanges, of a range, over the views that see this range, and ranges
// that overlap lie in layers, one a dispatch. Those that reached no tile or no pixel only cost a store.
// Bindings: gaussians, colors, cameras, splats, counts and, from params.begins, first records;
// grad_gaussians [count][3] (mean, opacity; scale, 0; rotation), grad_colors [count][sh_quads],
// exported [V*N][3] vec4 (dL/d mean 2 and its absolute sums; conic, opacity; colour, depth) and, from params.pose,
// [V][groups][3 or 4] vec4 (rows of dL/d[R|t] of this workgroup; dL/d of fx fy cx cy); view_ranges; records, as
// blend_backward writes them.
// Specialisation: kDegree, kExport: write exported, kPose: write pose, kIntrinsics: its fourth, too, kFlags.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "projection_backward.glsl"
#include "sh.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kProjectDegreeId) const uint kDegree = 0;
layout(constant_id = kProjectExportId) const bool kExport = false;
layout(constant_id = kProjectPoseId) const bool kPose = false;
layout(constant_id = kProjectIntrinsicsId) const bool kIntrinsics = false;
layout(constant_id = kProjectFlagsId) const uint kFlags = 0;
QUADS(0, gaussians);
QUADS(1, colors);
TABLE(2, cameras);
QUADS(3, splats);
UINTS(4, counts);
layout(set = 0, binding = 5, std430) buffer GradGaussians { vec4 grad_gaussians[]; };  // accumulates
layout(set = 0, binding = 6, std430) buffer GradColors { vec4 grad_colors[]; };        // accumulates
layout(set = 0, binding = 7, std430) buffer Exported { vec4 exported[]; };             // accumulates
UINT_TABLE(8, view_ranges);
#if TEXEL_LOADS
QUADS(9, record_a);
QUADS(10, record_b);
QUADS(11, record_c);
#define RECORD(array, k, i) LD4(array, i)
#else
QUADS(9, record_quads);
#define RECORD(array, k, i) record_quads[(i) * params.record_quads + k]
#endif
layout(push_constant) uniform Push { ProjectParams params; };

#include "launch.glsl"
#include "raster/view_ranges.glsl"
#include "reduce.glsl"

const uint kTerms = (kDegree + 1) * (kDegree + 1);
const uint kColorQuads = (3 * kTerms + 3) / 4;

vec3 grad_mean, grad_scale;
vec4 grad_q;
float grad_opacity;
float grad_sh[48];

// Gradient with respect to the mean through the viewing direction. Adds to grad_sh.
vec3 color_backward(uint index, vec3 mean, vec3 position, vec3 color, vec3 g) {
    if ((kFlags & kFlagDirectColors) != 0) {
        grad_sh[0] += g.x;
        grad_sh[1] += g.y;
        grad_sh[2] += g.z;
        return vec3(0);
    }
    g = mix(vec3(0), g, greaterThan(color, vec3(0)));
    const vec3 offset = mean - position;
    const float d2 = dot(offset, offset);
    const float inverse = d2 > 0.0 ? inversesqrt(d2) : 0.0;
    const vec3 d = offset * inverse;
    float basis[16];
    sh_basis(kDegree, d, basis);
    [[unroll]] for (uint k = 0; k < kTerms; ++k)
        [[unroll]] for (uint c = 0; c < 3; ++c) grad_sh[3 * k + c] += basis[k] * g[c];
    if (kDegree == 0) return vec3(0);
    float f[48];
    [[unroll]] for (uint i = 0; i < kColorQuads; ++i) {
        const vec4 v = LD4(colors, index * params.sh_quads + i);
        [[unroll]] for (uint c = 0; c < 4; ++c) f[4 * i + c] = v[c];
    }
    float weight[16];
    [[unroll]] for (uint k = 0; k < kTerms; ++k) weight[k] = dot(g, vec3(f[3 * k], f[3 * k + 1], f[3 * k + 2]));
    const vec3 by_d = sh_direction_gradient(kDegree, d, weight);
    return inverse * (by_d - dot(by_d, d) * d);
}

struct Gaussian {
    vec3 mean, scale;
    vec4 q;
    float opacity;
};

// Sums of an item's records, and its opacity after compensation (0 if it reached no tile).
struct Records {
    vec4 a, b, c;
    float opacity;
};

vec4 pose0, pose1, pose2;  // rows of dL/d[R|t] of one item
vec4 by_intrinsics;        // dL/d of fx fy cx cy

// Add one view's share to the gradients above.
void item_backward(uint index, uint v, uint item, Gaussian from, Records records) {
    View view;
    LOAD_VIEW(view, cameras, v);
    const Projection p = project(view, from.mean, from.scale, from.q);
    ImageGradient g;
    g.y = records.a.yz / kRootHalfLog2e;
    g.moments = vec3(records.a.w, records.b.xy) / (kRootHalfLog2e * kRootHalfLog2e);
    g.opacity = records.a.x / records.opacity;
    g.depth = records.c.w;
    GaussianGradient gradient;
    PoseGradient pose_gradient;
    projection_backward(view, p, from.mean, from.scale, from.opacity, g, kFlags, gradient,
                        pose_gradient);
    const vec3 color = LD4(splats, item * 3 + 2).xyz;
    const vec3 by_direction = color_backward(index, from.mean, view.position, color, records.c.xyz);
    grad_mean += gradient.mean + by_direction;
    grad_scale += gradient.scale;
    grad_q += quaternion_backward(from.q, gradient.rq);
    grad_opacity += gradient.opacity;
    if (kPose) {
        // The direction starts at the camera's position, -R^-1 t, which moves by -R^-1 (dt + dR position).
        const mat3 r = view.rotation;
        const mat3 cofactors = mat3(cross(r[1], r[2]), cross(r[2], r[0]), cross(r[0], r[1]));
        const vec3 moved = cofactors * by_direction / dot(r[0], cofactors[0]);
        const mat3 rotation = transpose(pose_gradient.rotation + outerProduct(moved, view.position));
        const vec3 translation = pose_gradient.translation + moved;
        pose0 = vec4(rotation[0], translation.x);
        pose1 = vec4(rotation[1], translation.y);
        pose2 = vec4(rotation[2], translation.z);
        by_intrinsics = pose_gradient.intrinsics;
    }
    if (kExport) {
        const vec4 before0 = params.accumulate != 0 ? exported[item * 3] : vec4(0);
        const vec4 before1 = params.accumulate != 0 ? exported[item * 3 + 1] : vec4(0);
        const vec4 before2 = params.accumulate != 0 ? exported[item * 3 + 2] : vec4(0);
        exported[item * 3] = before0 + vec4(mean_gradient(p, g.y), records.b.zw);
        exported[item * 3 + 1] = before1 + vec4(conic_gradient(p, g.moments), g.opacity);
        exported[item * 3 + 2] = before2 + records.c;
    }
}

// The Gaussian by its place in this dispatch's part of the set and its number among those that its views see, and the
// first of these views. Returns false if no invocation of the workgroup has one in this layer and part.
bool find_gaussian(out uint index, out uint number, out uint view, out bool present) {
    index = invocation_index(params.groups_x);
    number = params.first + index;
    view = 0;
    present = index < params.count;
    if ((kFlags & kFlagRanges) == 0) return true;
    const uint at = gl_WorkGroupID.y * params.groups_x + gl_WorkGroupID.x;
    VIEW_AT(at, kRangeGroups, params.views, view)
    const uint before = (at - RANGE_WORD(view, kRangeGroups)) * gl_WorkGroupSize.x;
    const uint begin = RANGE_WORD(view, kRangeFirst) + before - params.first;
    number = before + gl_LocalInvocationID.x;
    index = begin + gl_LocalInvocationID.x;
    present = number < RANGE_WORD(view, kRangeCount);
    return RANGE_WORD(view, kRangeLayer) == params.layer && begin < params.count;
}

void main() {
    const bool ranges = (kFlags & kFlagRanges) != 0;
    uint index, number, v;
    bool present;
    if (!find_gaussian(index, number, v, present)) return;
    const uint group = number / gl_WorkGroupSize.x;
    const uint groups_each = (params.gaussians + gl_WorkGroupSize.x - 1) / gl_WorkGroupSize.x;
    const vec4 g0 = present ? LD4(gaussians, index * 3) : vec4(0);
    const vec4 g1 = present ? LD4(gaussians, index * 3 + 1) : vec4(1);
    const vec4 raw_q = present ? LD4(gaussians, index * 3 + 2) : vec4(1, 0, 0, 0);
    const float q_norm = max(norm_of(raw_q), kQuaternionMin);
    const bool normalise = (kFlags & kFlagGsplat) != 0;
    const vec4 q = normalise ? raw_q / q_norm : raw_q;

    const Gaussian gaussian = Gaussian(g0.xyz, g1.xyz, q, g0.w);
    grad_mean = vec3(0);
    grad_scale = vec3(0);
    grad_q = vec4(0);
    grad_opacity = 0;
    [[unroll]] for (uint i = 0; i < 4 * kColorQuads; ++i) grad_sh[i] = 0;
    do {
        const uint item = (ranges ? RANGE_WORD(v, kRangeItems) : v * params.gaussians) + number;
        const uint pairs = present ? LD1(counts, item) : 0;
        Records records = Records(vec4(0), vec4(0), vec4(0), 0.0);
        if (pairs > 0) records.opacity = LD4(splats, item * 3).z;
        pose0 = vec4(0);
        pose1 = vec4(0);
        pose2 = vec4(0);
        by_intrinsics = vec4(0);
        if (records.opacity > 0.0) {
            const uint begin = LD1(counts, params.begins + item);
            for (uint i = begin; i < begin + pairs; ++i) {
                records.a += RECORD(record_a, 0, i);
                records.b += RECORD(record_b, 1, i);
                records.c += RECORD(record_c, 2, i);
            }
        }
        // If no pixel saw it, all sums and its gradient are zeros.
        if (records.a != vec4(0) || records.b != vec4(0) || records.c != vec4(0)) {
            item_backward(index, v, item, gaussian, records);
        } else if (kExport && present && params.accumulate == 0) {
            exported[item * 3] = vec4(0);
            exported[item * 3 + 1] = vec4(0);
            exported[item * 3 + 2] = vec4(0);
        }
        if (kPose) {
            pose0 = workgroup_sum(pose0);
            pose1 = workgroup_sum(pose1);
            pose2 = workgroup_sum(pose2);
            if (kIntrinsics) by_intrinsics = workgroup_sum(by_intrinsics);
            if (gl_LocalInvocationID.x == 0 && present) {
                const uint begin = ranges ? RANGE_WORD(v, kRangeGroups) : v * groups_each;
                const uint to = params.pose + (begin + group) * (kIntrinsics ? 4 : 3);
                exported[to] = pose0;
                exported[to + 1] = pose1;
                exported[to + 2] = pose2;
                if (kIntrinsics) exported[to + 3] = by_intrinsics;
            }
        }
        v = ranges ? RANGE_WORD(v, kRangeNext) : v + 1;
    } while (v < params.views);
    if (!present) return;
    if (normalise && grad_q != vec4(0)) grad_q = (grad_q - dot(grad_q, q) * q) / q_norm;
    const bool add = params.accumulate != 0 || (ranges && params.layer > 0);
    vec4 out0 = vec4(grad_mean, grad_opacity), out1 = vec4(grad_scale, 0), out2 = grad_q;
    if (add) {
        out0 += grad_gaussians[index * 3];
        out1 += grad_gaussians[index * 3 + 1];
        out2 += grad_gaussians[index * 3 + 2];
    }
    grad_gaussians[index * 3] = out0;
    grad_gaussians[index * 3 + 1] = out1;
    grad_gaussians[index * 3 + 2] = out2;
    [[unroll]] for (uint i = 0; i < kColorQuads; ++i) {
        vec4 g = vec4(grad_sh[4 * i], grad_sh[4 * i + 1], grad_sh[4 * i + 2], grad_sh[4 * i + 3]);
        if (add) g += grad_colors[index * params.sh_quads + i];
        grad_colors[index * params.sh_quads + i] = g;
    }
}
