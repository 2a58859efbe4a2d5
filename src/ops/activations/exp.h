#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Exponential:  y = exp(x),  grad_x = grad_y * y. Of logarithms of scales it makes the scales that the rasterizer
/// takes.
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    relative 2e-7, down to the least normal float, below which devices may give 0; infinite
///              where a float cannot hold it (tests/ops/activations/exp_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Cody & Waite 1980, "Software manual for the elementary functions", chapter 6
extern const OpRow kExpRow;

}  // namespace splat::ops
