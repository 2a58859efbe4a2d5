#version 460
// Project every Gaussian into every view, count the tiles it can reach and, if a pixel may see it, evaluate
// its colour: max(0, 0.5 + sum_k sh[k] Y_k(d)), d from the camera to the mean, or the colour given.
// One invocation computes one item (project_items.glsl). Items that are culled or not finite get
// radius 0, no tiles and the key 0xFFFFFFFF; those that are not finite are counted.
// Bindings: gaussians [N][3] vec4 (mean, opacity; scale, 0; rotation wxyz), colors [N][color_quads]
// vec4 (coefficients [K,3] flattened), cameras [V][6] vec4 (rows of [R|t]; fx fy cx cy; limits of the
// Jacobian; position); splats [V*N][3] vec4 (mean, opacity, depth; l11 l21 l22 and reach of
// tile_footprint.glsl; colour, half size of the 3dgs square; with kFlagRayMaximum a box of pixels in the middle, and l
// and e of ray_form.glsl behind all), counts [V*N] tiles, keys [V*N] uvec2
// (bits of the depth or, with kFlagSortByDistance, of the distance; item), radii [V*N] vec2 (their bits),
// footprints [V*N] uvec2, stats (include/params/tile_bin_params.h; kStatNotFinite starts as 0), background,
// active_tiles of call_views.glsl, view_ranges.
// Specialisation: kDegree of the spherical harmonics, kFlags.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "load.glsl"
#include "store.glsl"
#include "params/tile_bin_params.h"
#include "finite.glsl"
#include "projection.glsl"
#include "sh.glsl"
#include "raster/ray_form.glsl"
#include "raster/tile_footprint.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kProjectDegreeId) const uint kDegree = 0;
layout(constant_id = kProjectFlagsId) const uint kFlags = 0;
QUADS(0, gaussians);
QUADS(1, colors);
TABLE(2, cameras);
QUADS_OUT(3, splats);
layout(set = 0, binding = 4, std430) writeonly buffer Counts { uint counts[]; };
PAIRS_OUT(5, keys);
PAIRS_OUT(6, radii);
PAIRS_OUT(7, footprints);
layout(set = 0, binding = 8, std430) buffer Stats { uint stats[]; };  // accumulates
TABLE(9, background);
UINT_TABLE(10, active_tiles);
UINT_TABLE(11, view_ranges);
layout(push_constant) uniform Push { ProjectParams params; };

#include "raster/call_views.glsl"
#include "raster/project_items.glsl"

bool is_set(uint flag) { return (kFlags & flag) != 0; }

// Radius in pixels per axis; 0 if no pixel of the image can see the Gaussian.
vec2 visible_radius(Projection p, vec2 mean, float opacity, vec2 size) {
    if (is_set(kFlagGsplat)) {
        if (!(opacity >= kAlphaMin)) return vec2(0);
        const float k = min(kMaxSigma, sqrt(2.0 * max(log(255.0 * opacity), 0.0)));
        const vec2 r = ceil(k * sqrt(vec2(p.a, p.c)));
        const bool outside = any(lessThanEqual(mean + r, vec2(0))) || any(greaterThanEqual(mean - r, size));
        return outside ? vec2(0) : r;
    }
    const float half_gap = 0.5 * (p.a - p.c);
    const float lambda = 0.5 * (p.a + p.c) + sqrt(max(kLambdaFloor, half_gap * half_gap + p.b * p.b));
    const float r = ceil(kSigma3dgs * sqrt(lambda));
    const vec2 u = mean - 0.5;
    const vec2 tiles = ceil(size / float(kTileSize));
    const vec2 first = trunc(clamp((u - r) / float(kTileSize), vec2(0), tiles));
    const vec2 last = trunc(clamp((u + r + 15.0) / float(kTileSize), vec2(0), tiles));
    return any(lessThanEqual(last, first)) ? vec2(0) : vec2(r);
}

// 3dgs divides by z + kHomogeneousMin, with the origin in the middle of the image.
vec2 image_mean(View view, vec3 m, vec2 size) {
    const vec2 f = view.intrinsics.xy, centre = view.intrinsics.zw;
    if (is_set(kFlagGsplat)) return f * (m.xy / m.z) + centre;
    const vec2 middle = 0.5 * size;
    return (f * m.xy + (centre - middle) * m.z) / (m.z + kHomogeneousMin) + middle;
}

vec3 splat_color(uint index, vec3 offset) {
    if (is_set(kFlagDirectColors)) return LD4(colors, index).xyz;
    const float d2 = dot(offset, offset);
    float basis[16];
    sh_basis(kDegree, d2 > 0.0 ? offset * inversesqrt(d2) : vec3(0), basis);
    const uint terms = (kDegree + 1) * (kDegree + 1);
    float f[48];
    [[unroll]] for (uint i = 0; i < (3 * terms + 3) / 4; ++i) {
        const vec4 v = LD4(colors, index * params.sh_quads + i);
        [[unroll]] for (uint c = 0; c < 4; ++c) f[4 * i + c] = v[c];
    }
    vec3 color = vec3(0);
    [[unroll]] for (uint k = 0; k < terms; ++k)
        color += basis[k] * vec3(f[3 * k], f[3 * k + 1], f[3 * k + 2]);
    return finite(color) ? max(color + kShOffset, vec3(0)) : color;
}

// The same for the convention ray_maximum: half of the box that its pixels fill.
vec2 box_radius(vec4 box, float opacity, vec2 size) {
    const bool outside = any(lessThanEqual(box.zw, vec2(0))) || any(greaterThanEqual(box.xy, size));
    return outside || !(opacity >= kAlphaMin) ? vec2(0) : ceil(0.5 * (box.zw - box.xy));
}

// Number of tiles, and the footprint for tile_bin_emit.comp.
uint tile_count(vec4 a, vec4 b, float half_size, uint view, ivec2 size, out uvec2 packed) {
    packed = uvec2(0);
    if (is_set(kFlagCull) && !(a.z >= kAlphaMin)) return 0;
    const Footprint f = tile_footprint(a, b, half_size, kFlags, size, view_rows(size));
    uint count = 0;
    bool small = f.rect.w - f.rect.y <= kPackedRows && f.rect.z - f.rect.x <= kPackedColumns;
    int row = f.rect.y;  // lanes may end at different turns: no sum crosses lanes (shaders/README.md)
    int top = row;       // first row that has tiles
    if (row < f.rect.w) do {
        ivec2 columns = tile_columns(f, row, size);
        uint drawn = 0;
        if (is_set(kFlagTileMask)) drawn = active_columns(view, row, columns);
        const uint length = uint(max(columns.y - columns.x, 0));
        if (!is_set(kFlagTileMask)) drawn = length;
        small = small && drawn == length;  // a packed row has no gap
        if (count == 0) top = row;
        count += drawn;
        const uint bits = length | (length > 0 ? uint(columns.x - f.rect.x) << 4 : 0u);
        const uint shift = 8u * uint(row - top);
        if (shift < 32u) packed.y |= bits << shift;
        if (shift >= 32u) packed.x |= bits << (shift - 16u);
    } while (++row < f.rect.w);
    const uint window_row = view * (params.row_end - params.row_begin) + uint(top) - params.row_begin;
    packed.x |= window_row * ((params.width + 15) >> 4) + uint(f.rect.x);
    if (!small) packed = uvec2(kNotPacked, count);
    return count;
}

void main() {
    uint index, view_index, item;
    if (!item_of_invocation(index, view_index, item)) return;
    const vec4 g0 = LD4(gaussians, index * 3);
    const vec4 g1 = LD4(gaussians, index * 3 + 1);
    vec4 q = LD4(gaussians, index * 3 + 2);
    View view;
    LOAD_VIEW(view, cameras, view_index);

    const float q2 = dot(q, q);
    bool all_finite = finite(g0) && finite(g1.xyz) && finite(q);
    bool valid = all_finite && g0.w > 0.0 && q2 >= kQuaternionMin * kQuaternionMin;
    if (is_set(kFlagGsplat)) {
        q = shrunk(q);
        q *= inversesqrt(max(dot(q, q), kQuaternionMin * kQuaternionMin));
    }
    const ivec2 size = view_size(view_index);
    const Projection p = project(view, g0.xyz, g1.xyz, q);
    const float z = p.m.z;
    valid = valid && (is_set(kFlagGsplat) && !is_set(kFlagRayMaximum) ? z >= params.near_plane && z <= params.far_plane
                                          : z > params.near_plane && z <= params.far_plane);
    const vec2 mean = image_mean(view, p.m, vec2(size));
    float opacity = g0.w;
    RayForm ray;
    if (is_set(kFlagRayMaximum)) {
        const float reach = opacity_reach(is_set(kFlagOpacityExtent) ? opacity : max(opacity, 1.0), kFlags);
        ray = ray_form(view, p, g1.xyz, mean, max(reach, 0.0), params.near_plane);
        if (valid) all_finite = finite(ray.l) && finite(ray.e) && finite(vec3(mean, 0.0));
    } else if (valid) {
        all_finite = finite(p.det) && finite(vec3(p.a, p.b, p.c)) && finite(vec3(mean, 0.0));
    }
    valid = valid && all_finite;
    if (is_set(kFlagAntialias)) opacity *= max(kCompensationMin, sqrt(p.det0 / p.det));

    vec2 radius = vec2(0);
    if (valid && is_set(kFlagRayMaximum)) radius = box_radius(ray.seen, opacity, vec2(size));
    if (valid && !is_set(kFlagRayMaximum)) radius = visible_radius(p, mean, opacity, vec2(size));
    valid = valid && radius.x > 0.0 && radius.y > 0.0;
    const float half_size = is_set(kFlagGsplat) ? 0.0 : radius.x;
    vec4 a = valid ? vec4(mean, opacity, z) : vec4(0);
    vec4 b =
        valid ? vec4(kRootHalfLog2e * p.l, opacity_reach(opacity, kFlags)) : vec4(1, 0, 1, 0);
    if (is_set(kFlagRayMaximum)) b = valid ? ray.box : vec4(0, 0, -1, -1);
    uvec2 packed = uvec2(0);
    uint count = valid ? tile_count(a, b, half_size, view_index, size, packed) : 0u;
    vec3 color = vec3(0);
    // Computed even without tiles: the value must not depend on the window or on a skip.
    const bool dense = a.z >= kAlphaMin;
    if (valid && (dense || !is_set(kFlagCull))) {
        color = splat_color(index, g0.xyz - view.position);
        if (!finite(color)) {
            color = vec3(0);
            if (dense) {
                all_finite = valid = false;
                a = vec4(0);
                count = 0;
            }
        }
    }
    if (!all_finite) atomicAdd(stats[kStatNotFinite], 1u);
    ST4(splats, item * 3, a);
    ST4(splats, item * 3 + 1, b);
    ST4(splats, item * 3 + 2, vec4(color, half_size));
    if (is_set(kFlagRayMaximum)) {
        ST4(splats, params.rays + item * 2, valid ? ray.l : vec4(0));
        ST4(splats, params.rays + item * 2 + 1, valid ? ray.e : vec4(0));
    }
    counts[item] = count;
    ST2(footprints, item, count > 0 ? packed : uvec2(0));
    const bool sorted = count > 0 || (valid && !is_set(kFlagCull));
    const float key = is_set(kFlagSortByDistance) ? length(g0.xyz - view.position) : z;
    ST2(keys, item, uvec2(sorted ? floatBitsToUint(key) : 0xFFFFFFFFu, item));
    ST2(radii, item, floatBitsToUint(valid ? radius : vec2(0)));
}
