#version 460
// grad_a = grad_loss / elements * the slope: sign(a - b), 0 if they are equal. One invocation computes one quad.
// Bindings: a, b (quads), grad_loss [1], grad_a (quads).
#extension GL_GOOGLE_include_directive : require
#include "params/loss_params.h"

layout(local_size_x_id = kWorkgroupSizeId) in;
#define SLOPE(d) sign(d)
#include "pixel_loss.glsl"

void main() { slope_of_quad(); }
