#version 460
// Turn a network's output into 3D Gaussians, kPerPixel a pixel; gaussian_head_params.h names the blocks of channels.
//   p = ray * (sigmoid(depth) * (most - least) + least + origin) + point
//   means = r.xyz / (r.w + 1e-10), r = [p, 1] view_to_world      opacities, scales = activated
//   rotations = quaternion * q / max(|q|, 1e-12)   sh = colour, then the rest turned with the camera
// kHeadInputDepth: origin is the depth of each pixel. kHeadBox: p = clamp(point, least, most), no camera.
// kDirect: sh = (activated colour - 0.5) / kSh0. One invocation computes the Gaussians of one pixel.
// Bindings: net_out, rays, view_to_world, quaternion, focal, origin, gaussians [N,3] quads, colors
// [N,kColorQuads] quads, as src/gaussians/gaussian_set.h lays a set out. Specialisation: kPositions, kOffset, kDegree,
// kDirect, kPerPixel, kChannels, k*Activation, k*At.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/gaussian_head_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "gaussian_head.glsl"
#include "store.glsl"
QUADS_OUT(6, gaussians);
QUADS_OUT(7, colors);

float raw[4 * kQuads];

// Writes Gaussian `each` of a pixel.
void forward(Pixel at, uint each) {
    const uint c = each * kChannels, g = at.p * kPerPixel + each;
    const vec3 point = point_of(at.image, at.pixel, at.ray, sigmoid(raw[c + kDepthAt]), RAW3(c + kPointAt));
    const vec4 world = to_world(at.camera, point);
    const vec3 mean = world.xyz / (world.w + kDivisorGuard);
    vec3 scale = RAW3(c + kScaleAt);
    if (dims.isotropic != 0) scale = scale.xxx;
    const uint r = c + kRotationAt;
    const vec4 q = vec4(raw[r], raw[r + 1], raw[r + 2], raw[r + 3]);

    [[unroll]] for (uint i = 0; i < 3; ++i) scale[i] = activated(kScaleActivation, scale[i]);
    ST4(gaussians, 3 * g, vec4(mean, activated(kOpacityActivation, raw[c + kOpacityAt])));
    ST4(gaussians, 3 * g + 1, vec4(scale, 0));
    ST4(gaussians, 3 * g + 2, hamilton(at.camera.rotation, q / max(norm_of(q), kLeastNorm)));
    float sh[4 * kColorQuads];
    sh[3] = 0;
    [[unroll]] for (uint i = 0; i < 3; ++i) {
        const float colour = activated(kColourActivation, raw[c + kColourAt + i]);
        sh[i] = kDirect != 0 ? (colour - 0.5) / kSh0 : colour;
        if (kDegree > 0) {
            [[unroll]] for (uint t = 0; t < 3; ++t)
                sh[3 + 3 * t + i] = raw[c + kRestAt + i] * at.turn[0][t] + raw[c + kRestAt + 3 + i] * at.turn[1][t] +
                                    raw[c + kRestAt + 6 + i] * at.turn[2][t];
        }
    }
    [[unroll]] for (uint q = 0; q < kColorQuads; ++q)
        ST4(colors, kColorQuads * g + q, vec4(sh[4 * q], sh[4 * q + 1], sh[4 * q + 2], sh[4 * q + 3]));
}

void main() {
    const uint p = invocation_index(dims.groups_x);
    const uint count = dims.images * dims.pixels;
    if (p >= count) return;
    [[unroll]] for (uint q = 0; q < kQuads; ++q) {
        const vec4 value = LD4(net_out, q * count + p);
        [[unroll]] for (uint k = 0; k < 4; ++k) raw[4 * q + k] = value[k];
    }
    const Pixel at = pixel_of(p);
    if (kPerPixel == 1) {  // at constant places; of several the unrolled code would take long to compile
        forward(at, 0);
    } else {
        for (uint each = 0; each < kPerPixel; ++each) forward(at, each);
    }
}
