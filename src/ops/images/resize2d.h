#pragma once

#include "ops/op_table.h"
#include "ops/quads.h"

namespace splat::ops {

struct Resize2dAxis {
    std::uint32_t from = 1;  ///< pixels of x
    std::uint32_t to = 1;    ///< pixels of y
    double scale = 0;        ///< pixels of y for each of x; 0: to / from
};

struct Resize2dDesc {
    std::uint32_t n = 1;
    std::uint32_t c = 1;
    Resize2dAxis rows;
    Resize2dAxis columns;
    bool cubic = false;
    bool antialias = false;
};

/// Errors: kInvalidArgument for a scale that does not lead to the size of y within a pixel, kUnsupported for a factor
/// beyond 1024, a side beyond 2^20 pixels, and 2^31 elements.
Status resize2d_check(const Resize2dDesc& desc);

/// Images at another size. Along each axis pixel i of y has its middle at (i + 1/2) / scale pixels of x, and is the sum
/// of the pixels of x times the filter f at the distance of their middles:
///
///   y[i] = sum_j f(j + 1/2 - (i + 1/2) / scale) x[j]
///
/// with the nearest pixel in place of those outside. `antialias` stretches f by s = max(1, 1 / scale), f(d / s), and
/// divides the weights of the pixels inside by their sum. Sides of equal length are copied, whatever the scale is; not
/// by the cubic filter without antialias.
///
/// filter 0     linear: f(d) = 1 - |d|
/// filter 1     cubic: that of Keys with a = -3/4, with antialias -1/2
/// scale_x, scale_y   pixels of y for each of x, where they are not the quotient of the sizes; 0: that quotient
/// x, y         [N,C,H,W] and [N,C,height,width] float32 as quads; no aliasing
/// Errors       those of resize2d_check; nothing is recorded on error
/// Precision    two sums of as many terms as the filter has weights along each axis; weights to 2^-22
/// Determinism  bit-exact for any thread count
/// Source       Keys 1981, "Cubic convolution interpolation for digital image processing", eq. 4 and 13; the choices
///              of torch.nn.functional.interpolate with align_corners = False
///
/// The gradient: the same weights from y to x.
extern const OpRow kResize2dRow;

}  // namespace splat::ops
