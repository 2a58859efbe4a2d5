// What kernels of binning share. Needs `params`, TileBinParams.

#ifndef SPLAT_TILE_BIN_GLSL
#define SPLAT_TILE_BIN_GLSL

// First and end of one of the params.lanes contiguous chunks of `length` entries.
uvec2 tile_chunk(uint index, uint length) {
    const uint chunk = (length + params.lanes - 1) / params.lanes;
    const uint first = min(index * chunk, length);
    return uvec2(first, min(first + chunk, length));
}

// Where a walk over the tiles of a packed footprint (tile_footprint.glsl) is.
struct TileWalk {
    uvec2 rest;  // of the rows that are left; rows without tiles have no bits
    uint row, column;
    uint corner;  // key of the footprint's first tile
};

uint first_row(uvec2 rows) {
    return rows.x != 0 ? uint(findLSB(rows.x)) / 8u : 4u + uint(findLSB(rows.y)) / 8u;
}

uint tiles_per_row() { return (params.width + 15) >> 4; }

TileWalk first_tile(uvec4 packed, uint item) {
    const uint window = item / params.gaussians * (params.row_end - params.row_begin);
    const uint corner =
        (window + (packed.x >> 16) - params.row_begin) * tiles_per_row() + (packed.x & 0xFFFFu);
    return TileWalk(packed.yz, first_row(packed.yz), 0, corner);
}

// Its key, and on to the next.
uint take_tile(inout TileWalk walk) {
    const uint bits = walk.rest[walk.row >> 2] >> 8u * (walk.row & 3u);
    const uint tile = walk.corner + walk.row * tiles_per_row() + (bits >> 4 & 15u) + walk.column;
    ++walk.column;
    const bool done = walk.column >= (bits & 15u);
    if (done) walk.rest[walk.row >> 2] ^= (bits & 255u) << 8u * (walk.row & 3u);
    walk.row = done ? first_row(walk.rest) : walk.row;
    walk.column = done ? 0 : walk.column;
    return tile;
}

#endif
