// Addition that stays at 2^32 - 1 instead of wrapping.

#ifndef SPLAT_SATURATING_GLSL
#define SPLAT_SATURATING_GLSL

uint saturating_add(uint a, uint b) {
    const uint sum = a + b;
    return sum < a ? 0xFFFFFFFFu : sum;
}

#endif
