// The rows of slice s in the weight gradient of a linear layer: [slice_begin(s), slice_end(s)), a whole
// number of blocks of rows except in the last slice.

#ifndef SPLAT_LINEAR_SLICES_GLSL
#define SPLAT_LINEAR_SLICES_GLSL

const uint kBlock = 64;

uint slice_begin(uint s) {
    const uint blocks = (dims.rows + dims.slices * kBlock - 1) / (dims.slices * kBlock);
    return s * blocks * kBlock;
}
uint slice_end(uint s) { return min(slice_begin(s + 1), dims.rows); }

#endif
