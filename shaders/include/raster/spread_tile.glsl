// The tile of a workgroup of the blending kernels for CPU devices.

#ifndef SPLAT_SPREAD_TILE_GLSL
#define SPLAT_SPREAD_TILE_GLSL

// The tile (x, y of the window, view) and the part of it, of `parts`, that a workgroup computes.
// lavapipe gives each thread one contiguous run of workgroups. If params.spread is 0, tiles come in the order
// of tile_ranges_ordered_cpu.comp. Otherwise neighbouring rows of tiles, which cost about the same, go to
// workgroups far apart: at multiples of params.spread, which has no common divisor with the number of rows. One
// or two rows are not spread. Tiles of a row, and parts of a tile, stay together, as they read the same
// Gaussians. Needs `params`, BlendParams, and UINTS `order`.
uvec4 spread_tile(uint parts) {
    const uint width = params.tiles_x * parts;
    const uint line = gl_WorkGroupID.z * params.rows + gl_WorkGroupID.y;
    const uint index = line * width + gl_WorkGroupID.x;
    const bool ordered = params.spread == 0;
    const uint at = LD1(order, ordered ? index / parts : 0) * parts + index % parts;
    const uint row = ordered ? at / width : line * params.spread % (params.rows * params.views);
    const uint column = ordered ? at % width : gl_WorkGroupID.x;
    return uvec4(column / parts, row % params.rows, row / params.rows, column % parts);
}

#endif
