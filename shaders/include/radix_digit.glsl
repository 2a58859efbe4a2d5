// What a pass of the radix sort sorts by: (key - low) >> shift, its lowest `bits` bits. Needs `params`,
// RadixSortParams. With digits by the range of the keys the last passes are those that work.

#ifndef SPLAT_RADIX_DIGIT_GLSL
#define SPLAT_RADIX_DIGIT_GLSL

struct Digit {
    uint low;
    uint shift;
    uint bits;   // 0: the pass does nothing
    bool first;  // nothing was sorted before: entries come from the input
};

// The bits by which keys differ from the least one, in as few digits of at most `most_bits` (9 or fewer)
// as they take, all alike. `least` and `least_inverse`: least key, least complement of a key; both ~0
// without keys.
Digit ranged_digit(uint least, uint least_inverse, uint most_bits) {
    const uint most = max(least, ~least_inverse);
    const uint used = uint(max(findMSB(most - least) + 1, 1));
    const uint passes = (used + most_bits - 1) / most_bits;
    // used / passes, rounded up, without a division, which lavapipe does lane by lane.
    uint bits = most_bits;
    [[unroll]] for (uint k = 1; k < 9; ++k) bits -= used + k * passes <= passes * most_bits ? 1 : 0;
    bits = max(bits, 2);  // bins are read in quads
    const uint idle = params.passes - passes;
    if (params.pass < idle) return Digit(0, 0, 0, false);
    return Digit(least, (params.pass - idle) * bits, bits, params.pass == idle);
}

Digit fixed_digit(uint bits) { return Digit(0, params.pass * bits, bits, params.pass == 0); }

uint digit_of(uint key, Digit digit) {
    return ((key - digit.low) >> digit.shift) & ((1u << digit.bits) - 1);
}

// Lanes that share `count` entries: no more than chunks of params.chunk, and no fewer than params.least.
uint lanes_for(uint count) {
    return clamp((count + params.chunk - 1) / params.chunk, params.least, params.lanes);
}

// Which quads of `count` entries a lane owns: [x, y).
uvec2 lane_quads(uint lane, uint count, uint lanes) {
    const uint quads = (count + 3) / 4;
    const uint chunk = (quads + lanes - 1) / lanes;
    const uint begin = min(lane * chunk, quads);
    return uvec2(begin, min(begin + chunk, quads));
}

#endif
