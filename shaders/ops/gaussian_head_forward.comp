#version 460
// Turn a network's output into 3D Gaussians, kPerPixel a pixel; gaussian_head_params.h names the blocks of channels.
//   p = ray * (sigmoid(depth) * (most - least) + least + origin) + point
//   means = r.xyz / (r.w + 1e-10), r = [p, 1] view_to_world      opacities, scales = activated
//   rotations = quaternion * q / max(|q|, 1e-12)   sh = colour, then the rest turned with the camera
// kHeadInputDepth: origin is the depth of each pixel. kHeadBox: p = clamp(point, least, most), no camera.
// kDirect: sh = (activated colour - 0.5) / kSh0. One invocation computes the Gaussians of one pixel.
// Bindings: net_out, rays, view_to_world, quaternion, focal, origin, means, opacities, scales,
// rotations, sh. Specialisation: kPositions, kOffset, kDegree, kDirect, kPerPixel, kChannels, k*Activation, k*At.
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#include "params/gaussian_head_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#include "gaussian_head.glsl"
#include "store.glsl"
layout(set = 0, binding = 6, std430) writeonly buffer Means { float means[]; };
layout(set = 0, binding = 7, std430) writeonly buffer Opacities { float opacities[]; };
layout(set = 0, binding = 8, std430) writeonly buffer Scales { float scales[]; };
QUADS_OUT(9, rotations);
layout(set = 0, binding = 10, std430) writeonly buffer Sh { float sh[]; };

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

    opacities[g] = activated(kOpacityActivation, raw[c + kOpacityAt]);
    ST4(rotations, g, hamilton(at.camera.rotation, q / max(norm_of(q), kLeastNorm)));
    const uint first = 3 * g * (1 + 3 * kDegree);
    [[unroll]] for (uint i = 0; i < 3; ++i) {
        means[3 * g + i] = mean[i];
        scales[3 * g + i] = activated(kScaleActivation, scale[i]);
        const float colour = activated(kColourActivation, raw[c + kColourAt + i]);
        sh[first + i] = kDirect != 0 ? (colour - 0.5) / kSh0 : colour;
        if (kDegree > 0) {
            [[unroll]] for (uint t = 0; t < 3; ++t)
                sh[first + 3 + 3 * t + i] = raw[c + kRestAt + i] * at.turn[0][t] +
                                            raw[c + kRestAt + 3 + i] * at.turn[1][t] +
                                            raw[c + kRestAt + 6 + i] * at.turn[2][t];
        }
    }
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
