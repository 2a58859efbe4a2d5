// Position of tile `t` of the slice: its image, and the row and column of its first output pixel.

#ifndef SPLAT_WINOGRAD_TILE_GLSL
#define SPLAT_WINOGRAD_TILE_GLSL

struct Tile {
    uint image;
    int row;
    int column;
};

Tile tile_at(uint t) {
    const uint per_image = dims.tiles_x * dims.tiles_y;
    const uint tile = dims.first_tile + t;
    const uint image = tile / per_image;
    const uint rest = tile - image * per_image;
    const uint row = rest / dims.tiles_x;
    return Tile(image, int(row * kTile), int((rest - row * dims.tiles_x) * kTile));
}

#endif
