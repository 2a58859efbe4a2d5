// Product of two matrices on GPUs, by tiles in shared memory: sums over k of M[k][m] N[k][n].
// A workgroup computes kTile by kTile results, an invocation 8 by 8 of them. Steps of k go through shared memory as
// vec4, two of them in turn, so that one is read while the other is filled. A workgroup of twice the invocations
// takes two parts of each step, whose sums are added in the end. Four products are summed before they are added to the
// sum: its rounding errors are those of a quarter of the terms. Multiply-adds may be fused (rule 2 of docs/devices.md).
// The kernel defines
//   vec4 load_m(uint k, uint m), load_n(uint k, uint n)   elements of four k, the quad k, at m or n; or, with
//       PRODUCT_OF_ROWS, four of m or n, quads of these, at k
//   void store(uint m, uint n, vec4 value)                four results of the quad m at n
// Loads beyond the edges of m and n may return anything, and store leaves such results out; none is beyond k.
// Specialisation: workgroup size (kTile^2 / 64, or twice that), kTile: 64 or 128.

#ifndef SPLAT_PRODUCT_GLSL
#define SPLAT_PRODUCT_GLSL

#include "params/linear_params.h"
#include "workgroup.glsl"

layout(constant_id = kProductTileId) const uint kTile = 128;
const uint kSpan = kTile / 8;  // invocations along a side
const uint kThreads = kSpan * kSpan;
const uint kParts = kWorkgroupSize / kThreads;
const uint kDepth = kTile / 64;       // quads of k of a step: one load of each operand for each invocation
const uint kStage = kDepth * (kTile + 8);
#ifdef PRODUCT_OF_ROWS
const uint kStep = 4 * kDepth;
const uint kRow = kTile / 4 + 1;  // quads of one k, padded for the banks of shared memory
#else
const uint kStep = kDepth;
const uint kRow = kSpan + 1;  // quads of each eighth of a tile, padded
#endif

shared vec4 operands[9 * kWorkgroupSize / 2];  // [part][stage][m, n][kStage]
float sums[64];                                // [m][n]

vec4 load_m(uint k, uint m);
vec4 load_n(uint k, uint n);
void store(uint m, uint n, vec4 value);

uint product_part() { return gl_LocalInvocationID.x / kThreads; }

// Column and row of an invocation in its tile: 32 of them are 8 by 4, so that a load of shared memory serves many.
uvec2 product_at() {
    const uint thread = gl_LocalInvocationID.x % kThreads;
    const uint across = kSpan / 8;
    return uvec2(thread % 8 + thread / 32 % across * 8, thread / 8 % 4 + thread / 32 / across * 4);
}

#ifdef PRODUCT_OF_ROWS
void multiply(uint at_m, uint at_n) {
    [[unroll]] for (uint d = 0; d < kDepth; ++d) {
        vec4 n[8];  // [k][half]
        [[unroll]] for (uint r = 0; r < 8; ++r) n[r] = operands[at_n + (4 * d + r / 2) * kRow + r % 2 * kSpan];
        [[unroll]] for (uint h = 0; h < 2; ++h) {
            vec4 m[4];
            [[unroll]] for (uint r = 0; r < 4; ++r) m[r] = operands[at_m + (4 * d + r) * kRow + h * kSpan];
            [[unroll]] for (uint i = 0; i < 4; ++i)
                [[unroll]] for (uint j = 0; j < 8; ++j)
                    sums[8 * (4 * h + i) + j] += m[0][i] * n[j / 4][j % 4] + m[1][i] * n[2 + j / 4][j % 4] +
                                                 m[2][i] * n[4 + j / 4][j % 4] + m[3][i] * n[6 + j / 4][j % 4];
        }
    }
}
#else
void multiply(uint at_m, uint at_n) {
    [[unroll]] for (uint d = 0; d < kDepth; ++d) {
        vec4 n[8];
        [[unroll]] for (uint j = 0; j < 8; ++j) n[j] = operands[at_n + (8 * d + j) * kRow];
        [[unroll]] for (uint i = 0; i < 8; ++i) {
            const vec4 m = operands[at_m + (8 * d + i) * kRow];
            [[unroll]] for (uint j = 0; j < 8; ++j)
                sums[8 * i + j] += m.x * n[j].x + m.y * n[j].y + m.z * n[j].z + m.w * n[j].w;
        }
    }
}
#endif

// sums of part 0 += those of part 1, through shared memory in two halves.
void add_parts() {
    const uint thread = gl_LocalInvocationID.x % kThreads;
    [[unroll]] for (uint h = 0; h < 2; ++h) {
        barrier();
        [[unroll]] for (uint e = 0; e < 8; ++e) {
            const uint s = 32 * h + 4 * e;
            if (product_part() != 0)
                operands[e * kThreads + thread] = vec4(sums[s], sums[s + 1], sums[s + 2], sums[s + 3]);
        }
        barrier();
        [[unroll]] for (uint e = 0; e < 8; ++e)
            [[unroll]] for (uint c = 0; c < 4; ++c) sums[32 * h + 4 * e + c] += operands[e * kThreads + thread][c];
    }
}

// The tile with the first results (m, n), over k from `first` to `last`: quads, or rows with PRODUCT_OF_ROWS.
void product(uint m, uint n, uint first, uint last) {
    const uint thread = gl_LocalInvocationID.x % kThreads;
#ifdef PRODUCT_OF_ROWS
    const uint own = thread / kStep;  // quad of the tile that this invocation loads
    const uint ahead = thread % kStep;
    const uint keep_m = ahead * kRow + own, keep_n = keep_m;
    const uint from_m = m / 4 + own, from_n = n / 4 + own;
#else
    const uint own = thread % kTile;
    const uint ahead = thread / kTile;
    // Four consecutive m lie in one invocation, in a quad of the result; n lie kSpan apart.
    const uint keep_m = (8 * ahead + own / (4 * kSpan) * 4 + own % 4) * kRow + own / 4 % kSpan;
    const uint keep_n = (8 * ahead + own / kSpan) * kRow + own % kSpan;
    const uint from_m = m + own, from_n = n + own;
#endif
    const uvec2 at = product_at();
    uint stage = product_part() * 4 * kStage;
    uint k = first + product_part() * kStep + ahead;
    const uint steps = (last - first + kParts * kStep - 1) / (kParts * kStep);
    [[unroll]] for (uint i = 0; i < 64; ++i) sums[i] = 0;
    operands[stage + keep_m] = k < last ? load_m(k, from_m) : vec4(0);
    operands[stage + kStage + keep_n] = k < last ? load_n(k, from_n) : vec4(0);
    uint step = 0;
    do {
        barrier();
        k += kParts * kStep;
        // The next loads are under way during the products; the last ones are zeros.
        const vec4 next_m = k < last ? load_m(k, from_m) : vec4(0);
        const vec4 next_n = k < last ? load_n(k, from_n) : vec4(0);
        multiply(stage + at.y, stage + kStage + at.x);
        stage = step % 2 == 0 ? stage + 2 * kStage : stage - 2 * kStage;
        operands[stage + keep_m] = next_m;
        operands[stage + kStage + keep_n] = next_n;
        ++step;
    } while (step < steps);
    if (kParts > 1) add_parts();
    if (product_part() != 0) return;
    [[unroll]] for (uint h = 0; h < 2; ++h)
        [[unroll]] for (uint j = 0; j < 8; ++j) {
#ifdef PRODUCT_OF_ROWS
            const uint column = 4 * at.x + j % 4 + j / 4 * 4 * kSpan;
#else
            const uint column = at.x + j * kSpan;
#endif
            const uint s = 32 * h + j;
            store(m / 4 + at.y + h * kSpan, n + column, vec4(sums[s], sums[s + 8], sums[s + 16], sums[s + 24]));
        }
}

#endif
