#pragma once

#include "ops/op_table.h"

namespace splat::ops {

/// Gaussian error linear unit:  y = x Phi(x),  grad_x = grad_y * (Phi(x) + x phi(x)),  phi and Phi the density
/// and distribution of the normal distribution. With `tanh`, its approximation
///
///   y = x / 2 (1 + tanh(u)) = x sigmoid(2u),  u = sqrt(2 / pi) (x + 0.044715 x^3)
///   grad_x = grad_y * (s + x s (1 - s) 2u'),  s = sigmoid(2u)
///
/// as torch.nn.functional.gelu with approximate = "none" and "tanh".
///
/// x, y, grad_x, grad_y  [N,C,...] or [C], float32 as quads; y may be x, grad_x may be grad_y
/// Errors       kUnsupported beyond the device's binding limits; nothing is recorded on error
/// Precision    relative 5e-7 of y, also in both tails, down to the least normal float; with tanh, times
///              1 + 2|u| for x < 0 (tests/ops/activations/gelu_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       Hendrycks & Gimpel 2016, arXiv:1606.08415; erfc: shaders/include/activations/gelu.glsl
extern const OpRow kGeluRow;

}  // namespace splat::ops
