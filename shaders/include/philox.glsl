// Philox 4x32-10 (Salmon et al. 2011): four random words from a counter and a key, the same as
// src/core/rng.h.

#ifndef SPLAT_PHILOX_GLSL
#define SPLAT_PHILOX_GLSL

uvec4 philox(uvec4 counter, uvec2 key) {
    [[unroll]] for (uint round = 0; round < 10; ++round) {
        uint a_high, a_low, b_high, b_low;
        umulExtended(0xD2511F53u, counter.x, a_high, a_low);
        umulExtended(0xCD9E8D57u, counter.z, b_high, b_low);
        counter = uvec4(b_high ^ counter.y ^ key.x, b_low, a_high ^ counter.w ^ key.y, a_low);
        key += uvec2(0x9E3779B9u, 0xBB67AE85u);
    }
    return counter;
}

#endif
