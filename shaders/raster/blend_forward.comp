#version 460
// Front-to-back blending of each tile's list: image = sum_i w_i c_i + T background, w_i = alpha_i T_i,
// T_(i+1) = T_i (1 - alpha_i), alpha_i = min(kAlphaMax, opacity exp2(-|L^T q|^2)), skipped below
// kAlphaMin; a pixel stops before T would fall below params.stop_below. Kerbl et al. 2023, section 6.
// One workgroup computes a tile (gl_WorkGroupID.z is the view), one invocation a pixel.
// Bindings: splats, pairs uvec2 (tile, item; sorted), normals, ranges, background vec4 [1+V] (rgb; width, height
// of each view); image [V,H,W] vec4 (rgb, alpha), state [V,H,W] vec2 (T, list entries before the stop), extra
// [V,H,W] vec4 (sum w depth, expected depth, contributors, Gaussian of the largest w), median [V,H,W] depth of the last
// Gaussian blended where T > kMedianTransmittance, or 0. Specialisation: kExtra: write extra, kMedian: write median,
// kNormals: blend normals instead of colours, without background, kSizes: the image is 0 beyond a view's size, kIds:
// write the Gaussian, kParts: walk a part of each long list; until its last one, image is (rgb, T), extra
// (sum w depth, largest w, contributors, its Gaussian), and T negative where a pixel has stopped. The workgroup has
// kTileSize^2 invocations. kRays: alpha and depth are those of the maximum along the pixel's ray (ray_form.glsl).
#extension GL_GOOGLE_include_directive : require
#include "blend.glsl"
#include "table.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendExtraId) const bool kExtra = false;
layout(constant_id = kBlendNormalsId) const bool kNormals = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendIdsId) const bool kIds = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(constant_id = kBlendCutId) const bool kCut = false;
layout(constant_id = kBlendMedianId) const bool kMedian = false;
layout(constant_id = kBlendRaysId) const bool kRays = false;
layout(set = 0, binding = 0, std430) readonly buffer Splats { vec4 splats[]; };
layout(set = 0, binding = 1, std430) readonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 2, std430) readonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
TABLE(4, background);
layout(set = 0, binding = 5, std430) buffer Image { vec4 image[]; };  // accumulates
layout(set = 0, binding = 6, std430) buffer State { vec2 state[]; };  // accumulates
layout(set = 0, binding = 7, std430) buffer Extra { vec4 extra[]; };  // accumulates
layout(set = 0, binding = 8, std430) buffer Median { float median[]; };  // accumulates
layout(push_constant) uniform Push { BlendParams params; };

const uint kBatch = 64;
#include "raster/blend_pixel.glsl"

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uvec2 tile = uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 part;
    if (!walks(kParts, range, params.part_begin, params.part_entries, part)) return;

    Pixel p = begin_pixel(uvec2(lane % kTileSize, lane / kTileSize), corner, view, part.y - range.x);
    for (uint start = part.x; start < part.y; start += kBatch) {
        barrier();
        const uint filled = min(kBatch, part.y - start);
        if (lane < filled) stage(lane, pairs[start + lane].y, corner, view);
        barrier();
        for (uint i = 0; i < filled; ++i) blend(i, start - range.x + i, p);
    }
    write_pixel(p, !kParts || part.y == range.y);
}
