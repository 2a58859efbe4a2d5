// Needs `pairs`, texels: uvec2 (tile, value), sorted by tile.

#ifndef SPLAT_LOWER_BOUND_GLSL
#define SPLAT_LOWER_BOUND_GLSL

// Number of pairs among the first `count` with a tile below `key`.
uint lower_bound(uint key, uint count) {
    uint low = 0;
    while (count > 0) {
        const uint half_count = count / 2;
        const bool below = LD1(pairs, 2 * (low + half_count)) < key;
        low = below ? low + half_count + 1 : low;
        count = below ? count - half_count - 1 : half_count;
    }
    return low;
}

#endif
