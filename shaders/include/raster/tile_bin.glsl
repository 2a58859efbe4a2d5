// Shared by the binning kernels. Needs `params`, TileBinParams.

#ifndef SPLAT_TILE_BIN_GLSL
#define SPLAT_TILE_BIN_GLSL

// First and end of one of the params.lanes contiguous chunks of `length` entries.
uvec2 tile_chunk(uint index, uint length) {
    const uint chunk = (length + params.lanes - 1) / params.lanes;
    const uint first = min(index * chunk, length);
    return uvec2(first, min(first + chunk, length));
}

// Position of a walk over the tiles of a packed footprint (tile_footprint.glsl).
struct TileWalk {
    uvec2 rows;   // remaining rows, next one in the lowest bits
    uint key;     // key of the footprint's first column in this row
    uint column;  // column within the row
};

TileWalk first_tile(uvec2 packed) { return TileWalk(uvec2(packed.y, packed.x >> 16), packed.x & 0xFFFFu, 0); }

// Returns the key of the current tile and moves on. A row without tiles takes a turn without a key: taken is 0.
uint take_tile(inout TileWalk walk, out uint taken) {
    const uint length = walk.rows.x & 15u;
    const uint key = walk.key + (walk.rows.x >> 4 & 15u) + walk.column;
    taken = min(length, 1u);
    ++walk.column;
    const bool done = walk.column >= length;
    walk.rows = done ? uvec2(walk.rows.x >> 8 | walk.rows.y << 24, walk.rows.y >> 8) : walk.rows;
    walk.key += done ? (params.width + 15) >> 4 : 0;
    walk.column = done ? 0 : walk.column;
    return key;
}

#endif
