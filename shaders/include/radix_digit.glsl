// What a pass of the radix sort sorts by: (key - low) >> shift, its lowest `bits` bits. Needs `params`,
// RadixSortParams.

#ifndef SPLAT_RADIX_DIGIT_GLSL
#define SPLAT_RADIX_DIGIT_GLSL

struct Digit {
    uint low;
    uint shift;
    uint bits;  // 0: nothing is left to sort by, entries stay where they are
};

// The bits by which keys differ from the least one, in as few digits of at most `most_bits` as they
// take, all alike: passes after those have nothing to do. `least` and `least_inverse`: least key, least
// complement of a key; both ~0 without keys.
Digit ranged_digit(uint least, uint least_inverse, uint most_bits) {
    const uint most = max(least, ~least_inverse);
    const uint used = uint(max(findMSB(most - least) + 1, 1));
    const uint passes = (used + most_bits - 1) / most_bits;
    const uint bits = (used + passes - 1) / passes;
    return Digit(least, params.pass * bits, params.pass < passes ? bits : 0);
}

uint digit_of(uint key, Digit digit) {
    return ((key - digit.low) >> digit.shift) & ((1u << digit.bits) - 1);
}

// Lanes that share `count` entries: no more than chunks of params.chunk, and no fewer than params.least.
uint lanes_for(uint count) {
    return clamp((count + params.chunk - 1) / params.chunk, params.least, params.lanes);
}

#endif
