#version 460
// photo_loss_moments.comp, photo_loss_slopes.comp and photo_loss_slope_rows.comp in one, for devices whose shaders run
// on a CPU. 8 lanes go along 8 rows, kStep columns in a turn. A lane first takes a column and computes the window along
// it; then lanes and rows change places, and a lane takes a row. It keeps what the next turn needs.
// Needs a workgroup of one subgroup of at least 8.
// Bindings: image [V,H,W] quads, truth [H,W] uint; the window along rows over the three slopes, 9 numbers of a pixel:
// rows [ceil(H/8),ceil(W/2),2,8,2] quads, the first 8 of two columns, and rest [ceil(H/8),ceil(W/2),8,2], the last;
// partial: a quad per lane, of which this kernel writes the second number. Slopes by E[p^2] and E[q^2] are doubled.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_shuffle : require
#include "load.glsl"
#include "losses/photo_loss.glsl"
#include "store.glsl"

layout(local_size_x_id = kWorkgroupSizeId) in;
QUADS(0, image);
UINTS(1, truth);
OCTETS_OUT(2, rows);
PAIRS_OUT(3, rest);
QUADS_OUT(4, partial);

const int kStep = 8;
const int kKept = kTaps - 1;
const int kAll = kKept + kStep;
const int kHalf = kTaps / 2;

bool upper(uint by) { return (gl_SubgroupInvocationID & by) != 0; }

// The numbers of 8 rows from `at` on change places with those of 8 lanes: row r of lane c and row c of lane r.
#define EXCHANGE(type, v, at, by) \
    [[unroll]] for (int r = 0; r < kStep; ++r) { \
        if ((r & by) != 0) continue; \
        const type low = v[at + r], high = v[at + r + by]; \
        const type other = subgroupShuffleXor(upper(by) ? low : high, by); \
        v[at + r] = upper(by) ? other : low; \
        v[at + r + by] = upper(by) ? high : other; \
    }
#define TRANSPOSE(type, v, at) EXCHANGE(type, v, at, 4) EXCHANGE(type, v, at, 2) EXCHANGE(type, v, at, 1)

// Places of what the next turn needs.
#define KEEP(v, count) [[unroll]] for (int s = 0; s < count; ++s) v[s] = v[s + kStep];

// 1 - S and the slopes of S, those by E[p^2] and E[q^2] doubled: similarity() with a quotient for each denominator.
struct Slopes {
    vec3 unlike, by_means, by_pp, by_qq;
};

Slopes slopes(vec3 m, vec3 mpp, vec3 mq, vec3 mqq) {
    const vec3 mp = m + kPivot, mp2 = mp * mp, mq2 = mq * mq;
    const vec3 vp = max(mpp - m * m, vec3(0)), vq = max(mqq - mq2, vec3(0));
    const vec3 by_b1 = 1 / (0.5 * (mp2 + mq2) + kC1), by_b2 = 1 / (0.5 * (vp + vq) + kC2);
    const vec3 luminance = (0.5 * (mp2 - mq2) + kC1) * by_b1, structure = (0.5 * (vp - vq) + kC2) * by_b2;
    const vec3 unlike_structure = vq * by_b2, both = luminance * by_b2;
    const vec3 unlike = mq2 * by_b1 + luminance * unlike_structure;
    const vec3 by_pp = both * unlike_structure, by_qq = -(both * by_b2) * (vp + 2 * kC2);
    const vec3 by_means = structure * mq * (mp * mq - mp2 - 2 * kC1) * (by_b1 * by_b1);
    return Slopes(unlike, by_means - (m * by_pp + mq * by_qq), by_pp, by_qq);
}

void main() {
    const uint lane = gl_SubgroupInvocationID, block = gl_WorkGroupID.x;
    const int width = int(dims.width), height = int(dims.height), pairs = (width + 1) / 2;
    vec3 p[kAll], pp[kAll], q[kAll], qq[kAll], by_mean[kAll], by_pp[kAll], by_qq[kAll];
    uint counted[kHalf + kStep];
    [[unroll]] for (int s = 0; s < kKept; ++s) {
        p[s] = kOutside[0].rgb;
        pp[s] = kOutside[1].rgb;
        q[s] = qq[s] = by_mean[s] = by_pp[s] = by_qq[s] = vec3(0);
    }
    [[unroll]] for (int s = 0; s < kHalf; ++s) counted[s] = 0;
    int from[kAll];  // the rows that lanes read as columns
    bool within[kAll];
    [[unroll]] for (int s = 0; s < kAll; ++s) {
        const int y = int(block * 8) + s - kHalf;
        within[s] = y >= 0 && y < height;
        from[s] = clamp(y, 0, height - 1) * width;
    }
    float sum = 0;
    int first = 0;  // column of the first new moments; slopes are 5 columns behind, results 10
    do {
        vec3 op[kAll], opp[kAll], oq[kAll], oqq[kAll];  // a lane's column
        const int x = first + int(lane), column = min(x, width - 1);
        [[unroll]] for (int s = 0; s < kAll; ++s) {
            const uint word = LD1(truth, from[s] + column);
            const vec3 a = exposed(LD4(image, dims.image + from[s] + column).rgb), t = color_of(word).rgb;
            const bool here = counts(word) && within[s] && x < width;
            op[s] = here ? a + t - kPivot : vec3(-kPivot);
            oq[s] = here ? a - t : vec3(0);
            opp[s] = op[s] * op[s];
            oqq[s] = oq[s] * oq[s];
            if (s >= kHalf && s < kHalf + kStep) counted[s] = here ? 1 : 0;
            if (s < kKept) continue;
            p[s] = WINDOW(op, s - kKept);
            pp[s] = WINDOW(opp, s - kKept);
            q[s] = WINDOW(oq, s - kKept);
            qq[s] = WINDOW(oqq, s - kKept);
        }
        TRANSPOSE(vec3, p, kKept)
        TRANSPOSE(vec3, pp, kKept)
        TRANSPOSE(vec3, q, kKept)
        TRANSPOSE(vec3, qq, kKept)
        TRANSPOSE(uint, counted, kHalf)

        vec4 even[2];
        float even_rest;
        [[unroll]] for (int u = 0; u < kStep; ++u) {
            const Slopes found = slopes(WINDOW(p, u), WINDOW(pp, u), WINDOW(q, u), WINDOW(qq, u));
            const int s = kKept + u;
            const bool here = counted[u] != 0;
            by_mean[s] = here ? found.by_means : vec3(0);
            by_pp[s] = here ? found.by_pp : vec3(0);
            by_qq[s] = here ? found.by_qq : vec3(0);
            sum += here ? found.unlike.x + found.unlike.y + found.unlike.z : 0.0;

            const vec3 d = WINDOW(by_mean, u), e = WINDOW(by_pp, u), f = WINDOW(by_qq, u);
            const vec4 quads[2] = vec4[2](vec4(d, e.x), vec4(e.yz, f.xy));
            const int to = first + u - kKept;
            if (u % 2 == 0) {
                even = quads;
                even_rest = f.z;
            } else if (to > 0 && to <= width) {
                const uint pair = block * uint(pairs) + uint(to) / 2;
                ST8(rows, pair * 16 + lane, even[0], quads[0]);
                ST8(rows, pair * 16 + 8 + lane, even[1], quads[1]);
                ST2(rest, pair * 8 + lane, floatBitsToUint(vec2(even_rest, f.z)));
            }
        }
        KEEP(p, kKept)
        KEEP(pp, kKept)
        KEEP(q, kKept)
        KEEP(qq, kKept)
        KEEP(by_mean, kKept)
        KEEP(by_pp, kKept)
        KEEP(by_qq, kKept)
        KEEP(counted, kHalf)
        first += kStep;
    } while (first < width + kKept);
    ST4(partial, dims.first + block * 8 + lane, vec4(0, sum, 0, 0));
}
