// Which tile a workgroup of the blending kernels for CPU devices computes.

#ifndef SPLAT_SPREAD_TILE_GLSL
#define SPLAT_SPREAD_TILE_GLSL

// The tile (x, y of the window, view) and the part of it, of `parts`, that a workgroup computes.
// lavapipe gives each thread one contiguous run of workgroups. Tiles come in the order of
// tile_order_cpu.comp if params.spread is 0. Else neighbours in the image, which are alike in cost, go to
// workgroups far apart: multiples of params.spread, which has no divisor in common with their number.
// Needs `params`, BlendParams, and UINTS `order`.
uvec4 spread_tile(uint parts) {
    const uint width = params.tiles_x * parts;
    const uint total = width * params.rows * params.views;
    const uint index = (gl_WorkGroupID.z * params.rows + gl_WorkGroupID.y) * width + gl_WorkGroupID.x;
    const bool ordered = params.spread == 0;
    const uint at = LD1(order, ordered ? index / parts : 0) * parts + index % parts;
    const uint chosen = ordered ? at : index * params.spread % total;
    const uint row = chosen / width, column = chosen % width;
    return uvec4(column / parts, row % params.rows, row / params.rows, column % parts);
}

#endif
