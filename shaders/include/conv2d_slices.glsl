// The rows of pixels, of all images, in slice s of the weight gradient of a convolution:
// [slice_begin(s), slice_end(s)).

#ifndef SPLAT_CONV2D_SLICES_GLSL
#define SPLAT_CONV2D_SLICES_GLSL

uint slice_begin(uint s) {
    const uint rows = dims.n * dims.height;
    return min(s * ((rows + dims.slices - 1) / dims.slices), rows);
}
uint slice_end(uint s) { return slice_begin(s + 1); }

#endif
