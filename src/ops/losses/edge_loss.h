#pragma once

#include "ops/losses/loss.h"

namespace splat::ops {

struct EdgeLossDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    std::uint32_t height = 1;
    std::uint32_t width = 1;
    bool scharr =
        false;  ///< smooth by (3, 10, 3) / 16 across the derivative, else by (1, 2, 1) / 4
    bool weighted = false;

    [[nodiscard]] QuadDims quads() const { return {n, c, height * width}; }
};

/// Distance of the edges of two images, colours or depths: the mean over images, channels and pixels of
///
///   weight (|Dx (a - b)| + |Dy (a - b)|)
///
/// where Dx and Dy are Sobel's or Scharr's derivative, 1 on a ramp of 1 per pixel; indices beyond the image are
/// reflected at its border pixels (reflect-101, as OpenCV's default).
///
/// a, b         [N,C,H,W] float32 as quads, zero in the channels that pad a quad
/// weight       [N,1,H,W] as quads; may be absent
/// slopes       saved for backward: along x and y
/// loss         [1]; 0 for images that differ by a constant
/// Errors       the recorder's, beyond the device's binding limits
/// Precision    relative 1e-6 of the sum of the terms' magnitudes (tests/ops/losses/edge_loss_test.cpp)
/// Determinism  bit-exact for any thread count
/// Source       the gradient difference loss of Mathieu et al. 2016, arXiv:1511.05440, eq. 6 with alpha 1, with
///              signed derivatives, by the filters of Sobel 1968 and Scharr 2000
///
/// The gradient with respect to a, overwritten: the transposed derivatives of weight times the signs; a
/// difference of 0 has the slope 0.
extern const OpRow kEdgeLossRow;

}  // namespace splat::ops
