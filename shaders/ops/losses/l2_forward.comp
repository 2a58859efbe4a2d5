#version 460
// partial = sum over a chunk of (a - b)^2; loss_sum averages them. One workgroup sums one chunk.
// Bindings: a, b (quads), partial [chunks].
#extension GL_GOOGLE_include_directive : require
#include "params/loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#define TERM(d) ((d) * (d))
#include "pixel_loss.glsl"

void main() { sum_chunk(); }
