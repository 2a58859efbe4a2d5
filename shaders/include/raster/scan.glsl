// Exclusive sums over quads of uint, 16 items for each invocation of a workgroup of a power of two. Sums stay at
// 2^32 - 1. Needs no subgroups.

#ifndef SPLAT_SCAN_GLSL
#define SPLAT_SCAN_GLSL

#include "saturating.glsl"
#include "workgroup.glsl"

shared uvec4 scan_scratch[2 * kWorkgroupSize];

uvec4 saturating_add(uvec4 a, uvec4 b) {
    const uvec4 sum = a + b;
    return mix(sum, uvec4(0xFFFFFFFFu), lessThan(sum, a));
}

uvec4 sums_before(uint start, uvec4 items) {
    const uint second = saturating_add(start, items.x), third = saturating_add(second, items.y);
    return uvec4(start, second, third, saturating_add(third, items.z));
}

// Replaces each item by the sum of those before it and of `before`, which moves on by the sum of all. Quad k of
// invocation l comes before its quad k + 1, and quad k of invocation l + 1 in between: loads and stores of k *
// kWorkgroupSize + l are coalesced. Every invocation must call.
void scan_quads(inout uvec4 quads[4], inout uint before) {
    const uint l = gl_LocalInvocationID.x;
    uvec4 sum;  // sum[k]: quads k of invocations up to this one
    [[unroll]] for (uint k = 0; k < 4; ++k)
        sum[k] = saturating_add(sums_before(0, quads[k]).w, quads[k].w);
    uint side = 0;
    barrier();  // the previous call's scratch may still be read
    scan_scratch[l] = sum;
    barrier();
    for (uint step = 1; step < kWorkgroupSize; step <<= 1) {
        if (l >= step) sum = saturating_add(sum, scan_scratch[side + l - step]);
        side = kWorkgroupSize - side;
        scan_scratch[side + l] = sum;
        barrier();
    }
    const uvec4 all = scan_scratch[side + kWorkgroupSize - 1];
    const uvec4 start = l > 0 ? scan_scratch[side + l - 1] : uvec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        quads[k] = sums_before(saturating_add(before, start[k]), quads[k]);
        before = saturating_add(before, all[k]);
    }
}

// The items of quad `at` that are among the first `count`, others as 0.
uvec4 kept_items(uvec4 quad, uint at, uint count) {
    return mix(uvec4(0), quad, lessThan(4 * at + uvec4(0, 1, 2, 3), uvec4(count)));
}

#endif
