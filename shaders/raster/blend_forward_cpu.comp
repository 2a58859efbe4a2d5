#version 460
// As blend_forward.comp for devices whose shaders run on a CPU, without shared memory or branches: 8
// lanes take 8 columns of a tile and kRows rows each, fetch 8 list entries at a time, one per lane,
// and pass them round by constant shuffles. Needs subgroups of at least 8.
// One workgroup computes 8 columns by kRows rows of a tile: gl_WorkGroupID.x counts the 16 * 16 / (8 *
// kRows) parts of each tile of a row, y the rows of tiles, z the views.
// Bindings and constant 10 as blend_forward.comp; 11 = leave out the test whether all pixels stopped.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#extension GL_KHR_shader_subgroup_vote : require
#include "blend.glsl"
#include "load.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const bool kExtra = false;
layout(constant_id = 11) const bool kNoEarlyOut = false;
QUADS(0, splats);
UINTS(1, items);
UINTS(2, pairs);
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
QUADS(4, background);
layout(set = 0, binding = 5, std430) writeonly buffer Image { vec4 image[]; };
layout(set = 0, binding = 6, std430) writeonly buffer State { vec2 state[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Extra { vec4 extra[]; };
layout(push_constant) uniform Push { BlendParams params; };

const int kRows = 8;

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uint part = gl_WorkGroupID.x & 3u;
    const uvec2 tile = uvec2(gl_WorkGroupID.x >> 2, gl_WorkGroupID.y);
    const uint view = gl_WorkGroupID.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 at = uvec2((part & 1u) * 8u + lane, (part >> 1) * uint(kRows));
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    const float x = float(at.x) + 0.5, y = float(at.y) + 0.5;
    const bool column_inside = corner.x + at.x < params.width;

    // Transmittance; once a pixel has stopped, minus that at which it did.
    float t[kRows], entries[kRows], contributors[kRows], depth[kRows];
    vec3 color[kRows];
    [[unroll]] for (int r = 0; r < kRows; ++r) {
        t[r] = column_inside && corner.y + at.y + uint(r) < params.height ? 1.0 : -1.0;
        entries[r] = 0.0;
        contributors[r] = 0.0;
        depth[r] = 0.0;
        color[r] = vec3(0);
    }
    for (uint start = range.x; start < range.y; start += 8) {
        const uint mine = start + lane;
        const uint item = LD1(items, LD1(pairs, min(mine, range.y - 1)));
        const vec4 a = LD4(splats, item * 3) - vec4(corner, 0, 0);
        const vec4 b = LD4(splats, item * 3 + 1);
        const vec4 c = LD4(splats, item * 3 + 2);
        const float opacity = mine < range.y ? a.z : 0.0;
        const float present = mine < range.y ? 1.0 : 0.0;
        [[unroll]] for (uint j = 0; j < 8; ++j) {
            const float o = subgroupShuffle(opacity, j);
            const float one = subgroupShuffle(present, j);
            const vec3 l = vec3(subgroupShuffle(b.x, j), subgroupShuffle(b.y, j), subgroupShuffle(b.z, j));
            const vec3 rgb = vec3(subgroupShuffle(c.x, j), subgroupShuffle(c.y, j), subgroupShuffle(c.z, j));
            const float z = kExtra ? subgroupShuffle(a.w, j) : 0.0;
            const float my = subgroupShuffle(a.y, j);
            precise float qx = subgroupShuffle(a.x, j) - x;
            precise float ux = l.x * qx;
            [[unroll]] for (int r = 0; r < kRows; ++r) {
                precise float qy = my - (y + float(r));
                precise float u = ux + l.y * qy;
                precise float v = l.z * qy;
                precise float power = -(u * u + v * v);
                precise float raw = min(kAlphaMax, o * exp2(power));
                const float alpha = raw >= kAlphaMin ? raw : 0.0;
                const float next = t[r] - t[r] * alpha;
                const bool stop = next < params.stop_below;
                const float w = stop ? 0.0 : alpha * t[r];
                t[r] = stop ? -abs(t[r]) : next;
                color[r] += w * rgb;
                entries[r] += stop ? 0.0 : one;
                if (kExtra) {
                    depth[r] += w * z;
                    contributors[r] += w > 0.0 ? 1.0 : 0.0;
                }
            }
        }
        if (!kNoEarlyOut) {
            float most = t[0];
            [[unroll]] for (int r = 1; r < kRows; ++r) most = max(most, t[r]);
            if (subgroupAll(most <= 0.0)) break;
        }
    }
    if (!column_inside) return;
    const vec3 behind = LD4(background, 0).rgb;
    [[unroll]] for (uint r = 0; r < uint(kRows); ++r) {
        if (corner.y + at.y + r < params.height) {
            const uint pixel = (view * params.height + corner.y + at.y + r) * params.width + corner.x + at.x;
            const float left = abs(t[r]);
            image[pixel] = vec4(color[r] + left * behind, 1.0 - left);
            state[pixel] = vec2(left, entries[r]);
            if (kExtra)
                extra[pixel] = vec4(depth[r], depth[r] / max(1.0 - left, kExpectedAlphaMin), contributors[r], 0);
        }
    }
}
