// The digit that a pass of the radix sort sorts by: the lowest `bits` bits of (key - low) >> shift. Needs
// `params`, RadixSortParams. If digits follow the range of the keys, only the last passes sort.

#ifndef SPLAT_RADIX_DIGIT_GLSL
#define SPLAT_RADIX_DIGIT_GLSL

struct Digit {
    uint low;
    uint shift;
    uint bits;   // 0: the pass does nothing
    bool first;  // nothing was sorted before: entries come from the input
};

// Splits the bits in which keys differ from the least one into as few equal digits of at most `most_bits`
// (9 or fewer) as possible. `least` and `least_inverse`: least key, least complement of a key; both ~0 if
// there are no keys.
Digit ranged_digit(uint least, uint least_inverse, uint most_bits) {
    const uint most = max(least, ~least_inverse);
    const uint used = uint(max(findMSB(most - least) + 1, 1));
    const uint passes = (used + most_bits - 1) / most_bits;
    // used / passes, rounded up, without a division: lavapipe divides lane by lane.
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

// Number of lanes that share `count` entries: one per params.chunk entries, at least params.least.
uint lanes_for(uint count) {
    return clamp((count + params.chunk - 1) / params.chunk, params.least, params.lanes);
}

// The quads of `count` entries that a lane owns: [x, y).
uvec2 lane_quads(uint lane, uint count, uint lanes) {
    const uint quads = (count + 3) / 4;
    const uint chunk = (quads + lanes - 1) / lanes;
    const uint begin = min(lane * chunk, quads);
    return uvec2(begin, min(begin + chunk, quads));
}

#endif
