// What a call draws of its images: views may be smaller than params.width x params.height, and tiles may be off.
// Needs kFlags, `params` with the window's tile rows, TABLE background and UINT_TABLE active_tiles.

#ifndef SPLAT_CALL_VIEWS_GLSL
#define SPLAT_CALL_VIEWS_GLSL

#include "params/project_params.h"
#include "table.glsl"

// Pixels of a view.
ivec2 view_size(uint view) {
    if ((kFlags & kFlagViewSizes) == 0) return ivec2(params.width, params.height);
    return ivec2(TABLE4(background, 1 + view).xy);
}

// Tile rows of the window that a view of this size has.
ivec2 view_rows(ivec2 size) {
    const ivec2 rows = ivec2(params.row_begin, params.row_end);
    return (kFlags & kFlagViewSizes) == 0 ? rows : min(rows, (size.y + 15) >> 4);
}

bool tile_is_active(uint view, int row, int column) {
    const uint words = (params.width + 511) >> 9, rows = (params.height + 15) >> 4;
    const uint word = TABLE1(active_tiles, (view * rows + uint(row)) * words + uint(column) / 32);
    return (word >> (uint(column) & 31u) & 1u) != 0;
}

// Narrows [x, y) of a row to its active tiles, and counts them.
uint active_columns(uint view, int row, inout ivec2 columns) {
    int first = columns.y, end = columns.x, column = columns.x;
    uint count = 0;
    if (column < columns.y) do {
        const bool on = tile_is_active(view, row, column);
        first = on ? min(first, column) : first;
        end = on ? column + 1 : end;
        count += on ? 1 : 0;
    } while (++column < columns.y);
    columns = ivec2(first, end);
    return count;
}

#endif
