#version 460
// Front-to-back blending of each tile's list: image = sum_i w_i c_i + T background, w_i = alpha_i T_i,
// T_(i+1) = T_i (1 - alpha_i), alpha_i = min(kAlphaMax, opacity exp2(-|L^T q|^2)), skipped below
// kAlphaMin; a pixel stops before T would fall below params.stop_below. Kerbl et al. 2023, section 6.
// One workgroup computes a tile (gl_WorkGroupID.z is the view), one invocation a pixel.
// Bindings: splats, pairs uvec2 (tile, item; sorted), normals, ranges, background vec4 [1+V] (rgb; width, height
// of each view); image [V,H,W] vec4 (rgb, alpha), state [V,H,W] vec2 (T, list entries before the stop), extra
// [V,H,W] vec4 (sum w depth, expected depth, contributors, Gaussian of the largest w). Specialisation: kExtra:
// write extra, kEarlyOut: end where every pixel has stopped (not in plain use; the same bits), kNormals: blend
// normals instead of colours, without background, kSizes: the image is 0 beyond a view's size, kIds: write the
// Gaussian, kParts: walk a part of each long list; until its last one, image is (rgb, T), extra (sum w depth, largest
// w, contributors, its Gaussian), and T negative where a pixel has stopped. The workgroup has kTileSize^2 invocations.
#extension GL_GOOGLE_include_directive : require
#include "blend.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kBlendExtraId) const bool kExtra = false;
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
layout(constant_id = kBlendNormalsId) const bool kNormals = false;
layout(constant_id = kBlendSizesId) const bool kSizes = false;
layout(constant_id = kBlendIdsId) const bool kIds = false;
layout(constant_id = kBlendPartsId) const bool kParts = false;
layout(set = 0, binding = 0, std430) readonly buffer Splats { vec4 splats[]; };
layout(set = 0, binding = 1, std430) readonly buffer Pairs { uvec2 pairs[]; };
layout(set = 0, binding = 2, std430) readonly buffer Normals { vec4 normals[]; };
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
layout(set = 0, binding = 4, std430) readonly buffer Background { vec4 background[]; };
layout(set = 0, binding = 5, std430) buffer Image { vec4 image[]; };  // accumulates
layout(set = 0, binding = 6, std430) buffer State { vec2 state[]; };  // accumulates
layout(set = 0, binding = 7, std430) buffer Extra { vec4 extra[]; };  // accumulates
layout(push_constant) uniform Push { BlendParams params; };

const uint kBatch = 64;
shared vec4 batch_a[kBatch];
shared vec4 batch_b[kBatch];
shared vec4 batch_c[kBatch];
shared uint running[2];  // 1 if a pixel goes on; batches alternate, so that one is read while the
                         // other is filled

void main() {
    const uint lane = gl_LocalInvocationID.x;
    const uvec2 tile = uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 at = uvec2(lane % kTileSize, lane / kTileSize);
    const uvec2 size = kSizes ? uvec2(background[1 + view].xy) : uvec2(params.width, params.height);
    const bool inside = corner.x + at.x < size.x && corner.y + at.y < size.y;
    const vec2 centre = vec2(at) + 0.5;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    const uint pixel = (view * params.height + corner.y + at.y) * params.width + corner.x + at.x;
    const bool in_image = kSizes ? corner.x + at.x < params.width && corner.y + at.y < params.height : inside;
    uvec2 part;
    if (!walks(kParts, range, params.part_begin, params.part_entries, part)) return;

    const bool carried = kParts && params.part_begin > 0 && in_image;
    const vec4 before = carried ? image[pixel] : vec4(0, 0, 0, inside ? 1.0 : -1.0);
    const vec4 more = carried && kExtra ? extra[pixel] : vec4(0, 0, 0, -1.0);
    float t = abs(before.a);
    bool stopped = before.a < 0.0;
    uint entries = carried && !kNormals ? uint(state[pixel].y) : 0, contributors = uint(more.z);
    float most = more.y, id = more.w;
    vec4 sum = vec4(before.rgb, more.x);
    uint side = 0;
    if (kEarlyOut) {
        if (lane < 2) running[lane] = 0;
        barrier();
    }
    for (uint start = part.x; start < part.y; start += kBatch) {
        if (kEarlyOut && !stopped) atomicOr(running[side], 1u);
        barrier();
        if (kEarlyOut && running[side] == 0) break;
        const uint filled = min(kBatch, part.y - start);
        if (lane < filled) {
            const uint item = pairs[start + lane].y;
            batch_a[lane] = splats[item * 3] - vec4(corner, 0, 0);
            batch_b[lane] = splats[item * 3 + 1];
            batch_c[lane] = kNormals ? normals[item] : splats[item * 3 + 2];
            if (kIds) batch_c[lane].w = float(item - view * params.gaussians);
        }
        barrier();
        if (kEarlyOut && lane == 0) running[side] = 0;
        side ^= 1u;
        for (uint i = 0; i < filled; ++i) {
            if (kEarlyOut && stopped) break;
            const vec4 a = batch_a[i];
            precise float alpha = min(kAlphaMax, a.z * exp2(log2_weight(a.xy, batch_b[i].xyz, centre)));
            alpha = alpha >= kAlphaMin ? alpha : 0.0;
            const float next = t - t * alpha;
            stopped = stopped || next < params.stop_below;
            const float w = stopped ? 0.0 : alpha * t;
            t = stopped ? t : next;
            sum += w * vec4(batch_c[i].xyz, a.w);
            entries += stopped ? 0 : 1;
            contributors += w > 0.0 ? 1 : 0;
            if (kIds) {
                id = w > most ? batch_c[i].w : id;
                most = max(most, w);
            }
        }
    }
    if (!in_image) return;
    if (kParts && part.y < range.y) {
        image[pixel] = vec4(sum.rgb, stopped ? -t : t);
        if (!kNormals) state[pixel] = vec2(t, float(entries));
        if (kExtra) extra[pixel] = vec4(sum.a, most, float(contributors), id);
        return;
    }
    const vec3 behind = kNormals || (kSizes && !inside) ? vec3(0) : t * background[0].rgb;
    image[pixel] = vec4(sum.rgb + behind, 1.0 - t);
    if (!kNormals) state[pixel] = vec2(t, float(entries));
    const float expected = sum.w / max(1.0 - t, kExpectedAlphaMin);
    if (kExtra) extra[pixel] = vec4(sum.w, expected, float(contributors), kIds ? id : 0.0);
}
