#version 460
// Like blend_forward.comp, for GPUs, with the same operations in the same order for each pixel. The workgroup stages as
// many list entries as it has invocations. Each subgroup takes a box of pixels, tests one staged entry a lane against
// the box, and blends those that reach it. It rests once its pixels have stopped, and the workgroup ends with the last.
// Work per workgroup and invocation, bindings and specialisation as there; kEarlyOut: end where every pixel has
// stopped, kSkipBlocks: leave out entries that a subgroup's pixels cannot see. Subgroups without idle lanes.
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require
#extension GL_KHR_shader_subgroup_basic : require
#include "blend.glsl"
#include "blend_blocks.glsl"
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
layout(constant_id = kBlendEarlyOutId) const bool kEarlyOut = false;
layout(constant_id = kBlendSkipBlocksId) const bool kSkipBlocks = false;
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

const uint kBatch = kTileSize * kTileSize;
#include "raster/blend_pixel.glsl"

shared uint finished;  // subgroups whose pixels have all stopped

bool all_stopped(Pixel p) { return kEarlyOut && subgroupBallot(!p.stopped) == uvec4(0); }

// True if the box of pixels may see a staged entry; `entry`: of all pairs.
bool sees(uint place, uint entry, vec2 low, vec2 high, vec2 corner) {
    if (kRays) return boxes_meet(low + corner, high + corner, splats[pairs[entry].y * 3 + 1]);
    const vec2 mean = batch_a[place].xy;
    return reaches_box(low - mean, high - mean, batch_b[place]);
}

// Blends `count` staged entries, of which the first is number `begin` of the list, from `first` on. low, high: corners
// of the box, in the tile at `corner`.
void walk_batch(uint first, uint begin, uint count, vec2 low, vec2 high, vec2 corner, inout Pixel p) {
    const uint lanes = min(gl_WorkGroupSize.x / gl_NumSubgroups, 32u);
    for (uint from = 0; from < count; from += lanes) {
        const uint own = from + gl_SubgroupInvocationID, place = min(own, count - 1);
        const bool kept = !kSkipBlocks || sees(place, first + begin + place, low, high, corner);
        uint left = subgroupBallot(own < count && kept).x;
        while (left != 0) {
            const uint seen = from + uint(findLSB(left));
            left &= left - 1;
            blend(seen, begin + seen, p);
            if (all_stopped(p)) return;
        }
    }
}

void main() {
    const uint lane = gl_LocalInvocationID.x, lanes = gl_WorkGroupSize.x / gl_NumSubgroups;
    const uvec2 tile = uvec2(gl_WorkGroupID.x, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    uvec2 part;
    if (!walks(kParts, range, params.part_begin, params.part_entries, part)) return;

    const uint first = gl_SubgroupID * lanes;
    const vec2 low = vec2(pixel_of(first)) + 0.5, high = vec2(pixel_of(first + lanes - 1)) + 0.5;
    Pixel p = begin_pixel(pixel_of(first + gl_SubgroupInvocationID), corner, view, part.y - range.x);
    bool rests = false;
    if (lane == 0) finished = 0;
    for (uint start = part.x; start < part.y; start += kBatch) {
        barrier();
        if (finished == gl_NumSubgroups) break;
        if (start + lane < part.y) stage(lane, pairs[start + lane].y, corner, view);
        barrier();
        if (!rests) {
            walk_batch(range.x, start - range.x, min(kBatch, part.y - start), low, high, vec2(corner), p);
            rests = all_stopped(p);
            if (rests && subgroupElect()) atomicAdd(finished, 1u);
        }
    }
    write_pixel(p, !kParts || part.y == range.y);
}
