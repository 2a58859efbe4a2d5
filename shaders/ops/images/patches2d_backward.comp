#version 460
// Channels become pixels of patches: y[c, i * size + r, j * size + s] = x[(c * size + r) * size + s, i, j], for x the
// gradient of patches2d's y; it is the forward pass of the inverse operator, too.
// One invocation computes one quad of y or, with kPairs, those of a patch of 2 x 2, of a quarter of the reads.
// Bindings: x, y, both quads. Specialisation: kPairs.
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require
#include "load.glsl"
#include "store.glsl"
#include "params/images_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
layout(constant_id = kPatches2dPairsId) const uint kPairs = 0;
QUADS(0, x);
QUADS_OUT(1, y);
OCTETS_OUT(1, y_pairs);  // the same
layout(push_constant) uniform Push { Patches2dParams params; };

#include "launch.glsl"
#include "channels.glsl"

void store_pairs(uint i) {
    const uint patches = params.rows * params.columns;
    const uint plane = i / patches;
    const uint quad = plane / params.n;
    if (4 * quad >= params.c) return;
    const uint image = plane - quad * params.n;
    const uint cell = i - plane * patches;
    const uint top = cell / params.columns;
    vec4 pixels[4];  // for each channel
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const bool used = 4 * quad + k < params.c;
        const vec4 value = LD4(x, used ? ((4 * quad + k) * params.n + image) * patches + cell : 0);
        pixels[k] = used ? value : vec4(0);
    }
    [[unroll]] for (uint r = 0; r < 2; ++r) {
        const uint at = (2 * (plane * params.rows + top) + r) * params.columns + (cell - top * params.columns);
        const vec4 left = vec4(pixels[0][2 * r], pixels[1][2 * r], pixels[2][2 * r], pixels[3][2 * r]);
        const vec4 right =
            vec4(pixels[0][2 * r + 1], pixels[1][2 * r + 1], pixels[2][2 * r + 1], pixels[3][2 * r + 1]);
        ST8(y_pairs, at, left, right);
    }
}

void main() {
    const uint i = invocation_index(params.groups_x);
    if (kPairs != 0) {
        store_pairs(i);
        return;
    }
    const uint size = params.size;
    const uint width = params.columns * size;
    const uint pixels = params.rows * size * width;
    const uint plane = i / pixels;
    const uint quad = plane / params.n;
    if (4 * quad >= params.c) return;
    const uint image = plane - quad * params.n;
    const uint row = (i - plane * pixels) / width;
    const uint column = i - plane * pixels - row * width;
    const uint top = row / size;
    const uint left = column / size;
    const uint first = (4 * quad * size + row - top * size) * size + column - left * size;
    vec4 value = vec4(0);
    [[unroll]] for (uint k = 0; k < 4; ++k) {
        const bool used = 4 * quad + k < params.c;
        const uint channel = first + (used ? k : 0) * size * size;
        const uint at = ((channel / 4 * params.n + image) * params.rows + top) * params.columns + left;
        value[k] = used ? component(LD4(x, at), channel % 4) : 0.0;
    }
    ST4(y, i, value);
}
