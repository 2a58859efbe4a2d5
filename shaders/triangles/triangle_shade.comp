#version 460
// Pictures of samples whose triangles are known: means of light over a pixel's samples, linear; depth and normal at
// its centre. One invocation computes one pixel. color = base (0.35 + 0.25 (0.5 + 0.5 n.up) + 0.4 max(0, n.l)).
// Bindings: view (a table), vertices uvec4 [V], corners uvec4 [T] (vertices, material), corner_normals and
// corner_texcoords [T,3], or the corners; attributes: normals [N,3], texture coordinates [N,2], colours [V,2];
// texels: linear values of bytes, materials, textures, texels; samples as triangle_draw.comp; pictures vec4: where
// wanted, RGB of covered samples and their share; depth, normal; albedo and the share.
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "params/triangles/triangle_params.h"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
TABLE(0, view);
UINT_QUADS(1, vertices);
UINT_QUADS(2, corners);
UINTS(3, corner_normals);
UINTS(4, corner_texcoords);
UINTS(5, attributes);
UINTS(6, texels);
UINTS(7, samples);
layout(set = 0, binding = 8, std430) writeonly buffer Pictures { vec4 pictures[]; };
layout(push_constant) uniform Push { TriangleParams params; };

#include "launch.glsl"
#include "triangles/setup.glsl"
#include "triangles/surface.glsl"

struct Point {
    uvec4 corners;
    uint triangle;
    Hit hit;
    vec3 face;    // normal of the face on the side that is seen
    float twice;  // twice the area of the triangle
};

Point point_at(uint number, ivec2 subpixel) {
    Point point;
    point.triangle = number;
    point.corners = LDU4(corners, number);
    const Corner a = corner_of(point.corners.x), b = corner_of(point.corners.y), c = corner_of(point.corners.z);
    point.hit = hit_at(triangle_of(a, b, c, subpixel), 0, 0);
    // Differences of whole numbers below 2^30 are exact.
    const ivec3 from = vertex_of(point.corners.x);
    const vec3 face = cross(vec3(vertex_of(point.corners.y) - from) / 1073741824.0,
                            vec3(vertex_of(point.corners.z) - from) / 1073741824.0);
    point.twice = length(face);
    point.face = (point.hit.front ? face : -face) / max(point.twice, 1e-30);
    return point;
}

// The file's; 0: not known.
vec3 corner_normal(uint triangle, uint corner) {
    const uint stride = (params.mesh_bits & kMeshNormalIndices) != 0 ? 3 : 4;
    const uint index = LD1(corner_normals, stride * triangle + corner);
    if (index == kNoTriangle) return vec3(0);
    return vec3(attribute_at(3 * index), attribute_at(3 * index + 1), attribute_at(3 * index + 2));
}

vec3 normal_of(Point point) {
    vec3 normal = vec3(0);
    if ((params.mesh_bits & kMeshNormals) == 0) return point.face;
    for (uint k = 0; k < 3; ++k) {
        const vec3 given = corner_normal(point.triangle, k);
        normal += point.hit.weights[k] * (given == vec3(0) ? point.face : given);
    }
    const float size = length(normal);
    if (size < 1e-6) return point.face;
    return dot(normal, point.face) < 0 ? -normal / size : normal / size;
}

vec3 turned(vec3 v) {
    return normalize(vec3(dot(TABLE4(view, kViewRight).xyz, v), dot(TABLE4(view, kViewDown).xyz, v),
                          dot(TABLE4(view, kViewFront).xyz, v)));
}

float light_on(vec3 normal) {
    return 0.35 + 0.25 * (0.5 + 0.5 * dot(normal, TABLE4(view, kViewUp).xyz)) +
           0.4 * max(dot(normal, TABLE4(view, kViewLight).xyz), 0.0);
}

void main() {
    const uint i = invocation_index(params.groups_x);
    const uint pixels = params.width * (params.row_end - params.row_begin);
    if (i >= pixels) return;
    const uvec2 pixel = uvec2(i % params.width, params.row_begin + i / params.width);
    const uint per_pixel = params.samples * params.samples;
    const uint numbers = pixels * (per_pixel + params.centers);
    vec4 color = vec4(0);
    vec3 albedo = vec3(0);
    for (uint s = 0; s < per_pixel; ++s) {
        const uint number = LD1(samples, numbers + i * per_pixel + s);
        if (number == kNoTriangle) continue;
        const uint step = kSubpixels / params.samples;
        const uvec2 subpixel = pixel * kSubpixels + uvec2(s % params.samples, s / params.samples) * step + step / 2;
        const Point point = point_at(number, ivec2(subpixel));
        const vec3 normal = normal_of(point);
        const float spread = spread_of(point.face * point.twice * (1073741824.0 * 1073741824.0),
                                       vec2(subpixel) / float(kSubpixels), point.hit.z);
        const vec3 base = base_color(point.corners, number, point.hit.weights, spread).xyz;
        albedo += base;
        color += vec4(params.lit != 0 ? base * light_on(normal) : base, 1);
    }
    const float count = max(float(per_pixel), 1.0);
    if (params.color_at != kNoTriangle) pictures[params.color_at + i] = color / count;
    if (params.albedo_at != kNoTriangle) pictures[params.albedo_at + i] = vec4(albedo, color.w) / count;
    if (params.maps_at == kNoTriangle) return;
    const uint number = LD1(samples, numbers + pixels * per_pixel + i);
    vec4 maps = vec4(0);
    if (number != kNoTriangle) {
        const Point point = point_at(number, ivec2(pixel * kSubpixels + kSubpixels / 2));
        maps = vec4(uintBitsToFloat(LD1(samples, pixels * per_pixel + i)), turned(normal_of(point)));
    }
    pictures[params.maps_at + i] = maps;
}
