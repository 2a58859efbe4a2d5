#version 460
// Pixels of an image in the form that others take: each of a quad's numbers v becomes the byte 255 v, rounded to
// nearest, halves up, and clamped (NaN is 0), or float16. One invocation writes one pixel.
// Bindings: colors, quads; pixels, one word each, or two with kHalves, the first number in the lowest bits.
// Specialisation: kHalves: float16.
#extension GL_GOOGLE_include_directive : require
#include "keep_nan.glsl"
#include "load.glsl"
#include "params/raster_reduce_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kReduceHalvesId) const bool kHalves = false;
QUADS(0, colors);
layout(set = 0, binding = 1, std430) writeonly buffer Pixels { uint pixels[]; };
layout(push_constant) uniform Push { RasterPixelsParams params; };

#include "launch.glsl"

// The host computes the same in double precision. 256 v is exact, and so is its distance to a rounding limit near it;
// that 255 v reaches the limit is 256 v - limit >= v.
uint byte_of(float v) {
    if (!(v > 0)) return 0;
    if (v >= 1) return 255;
    float near = floor(255 * v + 0.5);
    if (256 * v - (near - 0.5) < v) near -= 1;
    else if (256 * v - (near + 0.5) >= v) near += 1;
    return uint(near);
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (i >= params.count) return;
    const vec4 v = LD4(colors, i);
    if (kHalves) {
        pixels[2 * i] = packHalf2x16(v.xy);
        pixels[2 * i + 1] = packHalf2x16(v.zw);
    } else {
        pixels[i] = byte_of(v.x) | byte_of(v.y) << 8 | byte_of(v.z) << 16 | byte_of(v.w) << 24;
    }
}
