#version 460
// As blend_backward.comp for devices whose shaders run on a CPU: 8 lanes take a whole tile, 2 columns
// by 16 rows each. 8 list entries are fetched at once and rotated through the lanes; a lane sums its
// 32 pixels, a butterfly the lanes. Needs subgroups of at least 8.
// One workgroup computes a tile, which spread_tile.glsl chooses. Bindings and specialisation as
// blend_backward.comp; 12 = walk the whole list, also what no pixel reached.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_basic : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "blend.glsl"
#include "load.glsl"

layout(local_size_x_id = 0) in;
layout(constant_id = 10) const bool kDepth = false;
layout(constant_id = 11) const bool kAbsolute = false;
layout(constant_id = 12) const bool kWholeList = false;
QUADS(0, splats);
UINTS(1, pairs);
UINTS(2, slots);
layout(set = 0, binding = 3, std430) readonly buffer Ranges { uvec2 ranges[]; };
QUADS(4, background);
layout(set = 0, binding = 5, std430) readonly buffer State { vec2 state[]; };
QUADS(6, grad_image);
layout(set = 0, binding = 7, std430) readonly buffer GradDepth { float grad_depth[]; };
layout(set = 0, binding = 8, std430) writeonly buffer RecordA { vec4 record_a[]; };
layout(set = 0, binding = 9, std430) writeonly buffer RecordB { vec4 record_b[]; };
layout(set = 0, binding = 10, std430) writeonly buffer RecordC { vec4 record_c[]; };
UINTS(11, order);
layout(push_constant) uniform Push { BlendParams params; };

#include "spread_tile.glsl"

const int kRows = 16;
const int kPixels = 2 * kRows;
const uint kSums = 12;

// Per pixel of the lane: transmittance, what lies behind, gradients, entries before the stop.
float t[kPixels], behind[kPixels], g_r[kPixels], g_g[kPixels], g_b[kPixels], g_z[kPixels], stop[kPixels];

float lanes_sum(float v) {
    v += subgroupShuffleXor(v, 1u);
    v += subgroupShuffleXor(v, 2u);
    v += subgroupShuffleXor(v, 4u);
    return v;
}

// Sums over the lane's pixels, in the order of the record.
void one_splat(vec3 a, vec3 l, vec4 color, float x, float index, out float sums[kSums]) {
    vec4 sum_c = vec4(0);
    float m00 = 0.0, m10 = 0.0, m01 = 0.0, m20 = 0.0, m11 = 0.0, m02 = 0.0;
    vec2 slope = vec2(0);
    [[unroll]] for (int h = 0; h < 2; ++h) {
        precise float qx = a.x - (x + 8.0 * float(h));
        precise float ux = l.x * qx;
        float m0 = 0.0, m1 = 0.0, m2 = 0.0;
        [[unroll]] for (int r = 0; r < kRows; ++r) {
            const int q = h * kRows + r;
            precise float qy = a.y - (0.5 + float(r));
            precise float u = ux + l.y * qy;
            precise float w2 = l.z * qy;
            precise float power = -(u * u + w2 * w2);
            precise float raw = a.z * exp2(power);
            precise float clamped = min(kAlphaMax, raw);
            const float alpha = clamped >= kAlphaMin && index < stop[q] ? clamped : 0.0;
            t[q] = t[q] / (1.0 - alpha);
            const float w = alpha * t[q];
            float e = color.r * g_r[q] + color.g * g_g[q] + color.b * g_b[q] - behind[q];
            if (kDepth) e += color.a * g_z[q];
            behind[q] += alpha * e;
            sum_c.rgb += w * vec3(g_r[q], g_g[q], g_b[q]);
            if (kDepth) sum_c.a += w * g_z[q];
            const float straight = alpha > 0.0 ? raw * t[q] : 0.0;
            const float v = (params.straight_through != 0 ? straight : raw <= kAlphaMax ? w : 0.0) * e;
            const float vy = v * qy;
            m0 += v;
            m1 += vy;
            m2 += vy * qy;
            if (kAbsolute)
                slope += kTwoLn2 * abs(v * vec2(l.x * u, l.y * u + l.z * w2));
        }
        m00 += m0;
        m10 += m0 * qx;
        m20 += m0 * qx * qx;
        m01 += m1;
        m11 += m1 * qx;
        m02 += m2;
    }
    sums = float[kSums](m00, m10, m01, m20, m11, m02, slope.x, slope.y, sum_c.r, sum_c.g, sum_c.b, sum_c.a);
}

void main() {
    const uint lane = gl_LocalInvocationID.x & 7u;
    const uvec4 work = spread_tile(1);
    const uvec2 tile = work.xy;
    const uint view = work.z;
    const uvec2 corner = uvec2(tile.x, tile.y + params.row_begin) * kTileSize;
    const uvec2 range = ranges[(view * params.rows + tile.y) * params.tiles_x + tile.x];
    const vec3 background_rgb = LD4(background, 0).rgb;
    float last = 0.0;
    [[unroll]] for (uint q = 0; q < uint(kPixels); ++q) {
        const uvec2 at = uvec2(corner.x + lane + 8u * (q / uint(kRows)), corner.y + q % uint(kRows));
        const bool inside = at.x < params.width && at.y < params.height;
        const uint pixel = inside ? (view * params.height + at.y) * params.width + at.x : 0u;
        const vec4 g = inside ? LD4(grad_image, pixel) : vec4(0);
        const vec2 end = inside ? state[pixel] : vec2(1, 0);
        g_r[q] = g.r;
        g_g[q] = g.g;
        g_b[q] = g.b;
        g_z[q] = kDepth && inside ? grad_depth[pixel] : 0.0;
        behind[q] = dot(background_rgb, g.rgb) - g.a;
        t[q] = end.x;
        stop[q] = end.y;
        last = max(last, end.y);
    }
    last = max(last, subgroupShuffleXor(last, 1u));
    last = max(last, subgroupShuffleXor(last, 2u));
    last = max(last, subgroupShuffleXor(last, 4u));
    const uint length = range.y - range.x;
    const uint walked = kWholeList ? (length + 7u) & ~7u : (min(uint(last), length) + 7u) & ~7u;
    for (uint k = walked; k < length; k += 8) {
        if (k + lane < length) {
            const uint slot = LD1(slots, range.x + k + lane);
            record_a[slot] = vec4(0);
            record_b[slot] = vec4(0);
            record_c[slot] = vec4(0);
        }
    }
    const uint next_lane = (lane + 7u) & 7u;
    for (uint k = walked; k > 0;) {
        k -= 8;
        const bool present = k + lane < length;
        const uint entry = range.x + min(k + lane, length - 1);
        const uint item = LD1(pairs, 2 * entry + 1);
        vec4 a = LD4(splats, item * 3) - vec4(corner, 0, 0);
        vec3 l = LD4(splats, item * 3 + 1).xyz;
        vec4 c = vec4(LD4(splats, item * 3 + 2).rgb, a.w);
        if (!present) a.z = 0.0;
        float record[kSums];
        [[unroll]] for (uint i = 0; i < kSums; ++i) record[i] = 0.0;
        // Lane 7's entry is taken, then all move up by one lane.
        [[dont_unroll]] for (uint j = 8; j > 0;) {
            --j;
            float sums[kSums];
            one_splat(vec3(subgroupShuffle(a.x, 7u), subgroupShuffle(a.y, 7u), subgroupShuffle(a.z, 7u)),
                      vec3(subgroupShuffle(l.x, 7u), subgroupShuffle(l.y, 7u), subgroupShuffle(l.z, 7u)),
                      vec4(subgroupShuffle(c.r, 7u), subgroupShuffle(c.g, 7u), subgroupShuffle(c.b, 7u),
                           kDepth ? subgroupShuffle(c.a, 7u) : 0.0),
                      float(lane) + 0.5, float(k + j), sums);
            a = vec4(subgroupShuffle(a.x, next_lane), subgroupShuffle(a.y, next_lane),
                     subgroupShuffle(a.z, next_lane), 0.0);
            l = vec3(subgroupShuffle(l.x, next_lane), subgroupShuffle(l.y, next_lane),
                     subgroupShuffle(l.z, next_lane));
            c = vec4(subgroupShuffle(c.r, next_lane), subgroupShuffle(c.g, next_lane),
                     subgroupShuffle(c.b, next_lane), kDepth ? subgroupShuffle(c.a, next_lane) : 0.0);
            [[unroll]] for (uint i = 0; i < kSums; ++i) {
                if ((i == 6 || i == 7) && !kAbsolute) continue;
                if (i == 11 && !kDepth) continue;
                const float sum = lanes_sum(sums[i]);
                record[i] = lane == j ? sum : record[i];
            }
        }
        if (present) {
            const uint slot = LD1(slots, entry);
            record_a[slot] = vec4(record[0], record[1], record[2], record[3]);
            record_b[slot] = vec4(record[4], record[5], record[6], record[7]);
            record_c[slot] = vec4(record[8], record[9], record[10], record[11]);
        }
    }
}
