#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Images at another size: a matrix of weights along each axis, y = R x C^T, whose transposes give the gradient. Pixel
/// i of y has its middle at (i + 1/2) / scale pixels of x; weights are the filter at the distances from the middles of
/// pixels of x. Without antialias pixels outside are the nearest one; with it the filter is stretched, and the weights
/// are divided by their sum. Sides of equal length are copied, whatever the scale is; not by the cubic filter without
/// antialias.
///
/// Magnitudes. Distances have one rounding, which weights have with the filter's slope, at most 1.5; with antialias so
/// has their sum.
namespace splat::ref {

struct ResizeAxis {
    std::size_t from;
    std::size_t to;
    double scale;  ///< 0: to / from
};

/// Keys 1981, eq. 4 and 13, for cubic.
template <class Real>
Real resize_filter(Real d, bool cubic, Real a) {
    const Real x = std::abs(d);
    if (!cubic) return std::max(1 - x, Real(0));
    if (x < 1) return ((a + 2) * x - (a + 3)) * x * x + 1;
    return x < 2 ? ((a * x - 5 * a) * x + 8 * a) * x - 4 * a : 0;
}

template <class Real>
struct ResizeTap {
    std::size_t pixel;  ///< index in x
    Real weight;
    Real magnitude;
};

/// One list for each pixel of y along an axis.
template <class Real>
using ResizeTaps = std::vector<std::vector<ResizeTap<Real>>>;

template <class Real>
ResizeTaps<Real> resize_taps(const ResizeAxis& axis, bool cubic, bool antialias) {
    const bool copied = axis.from == axis.to && (antialias || !cubic);
    const Real scale = axis.scale > 0 && !copied
                           ? axis.scale
                           : static_cast<Real>(axis.to) / static_cast<Real>(axis.from);
    const Real stretch = antialias ? std::max(Real(1), 1 / scale) : Real(1);
    const Real reach = (cubic ? 2 : 1) * stretch;
    const Real slope = cubic ? Real(1.5) : Real(1);
    ResizeTaps<Real> all(axis.to);
    for (std::size_t i = 0; i < axis.to; ++i) {
        Real total = antialias ? 0 : 1;
        const Real middle = (static_cast<Real>(i) + Real(0.5)) / scale;
        const auto last = static_cast<long>(std::ceil(middle + reach));
        for (auto j = static_cast<long>(std::floor(middle - reach)) - 1; j <= last; ++j) {
            const long pixel = std::clamp(j, 0L, static_cast<long>(axis.from) - 1);
            const Real d = static_cast<Real>(j) + Real(0.5) - middle;
            if (std::abs(d) >= reach || (antialias && pixel != j)) continue;
            const Real weight =
                resize_filter(d / stretch, cubic, antialias ? Real(-0.5) : Real(-0.75));
            all[i].push_back({static_cast<std::size_t>(pixel), weight,
                              (antialias ? 2 : 1) * (std::abs(weight) + slope)});
            if (antialias) total += weight;
        }
        for (ResizeTap<Real>& tap : all[i]) {
            tap.weight /= total;
            tap.magnitude /= total;
        }
    }
    return all;
}

/// Most terms of a sum over the taps of one pixel: of y, or, if `back`, of x.
template <class Real>
std::size_t most_terms(const ResizeTaps<Real>& taps, std::size_t from, bool back) {
    std::vector<std::size_t> terms(back ? from : taps.size());
    for (std::size_t i = 0; i < taps.size(); ++i)
        for (const ResizeTap<Real>& tap : taps[i]) ++terms[back ? tap.pixel : i];
    return *std::max_element(terms.begin(), terms.end());
}

struct ResizeShape {
    std::size_t planes;
    ResizeAxis rows;
    ResizeAxis columns;
    bool cubic;
    bool antialias;
};

/// From x to y, or, if `back`, from grad_y to grad_x.
template <class Real>
Summed<Real> resize2d(const ResizeShape& s, const std::vector<Real>& in, bool back) {
    const auto rows = resize_taps<Real>(s.rows, s.cubic, s.antialias);
    const auto columns = resize_taps<Real>(s.columns, s.cubic, s.antialias);
    const std::size_t from = s.rows.from * s.columns.from;
    const std::size_t to = s.rows.to * s.columns.to;
    Summed<Real> out(s.planes * (back ? from : to),
                     most_terms(rows, s.rows.from, back) +
                         most_terms(columns, s.columns.from, back));
    for (std::size_t y = 0; y < s.planes * to; ++y)
        for (const ResizeTap<Real>& row : rows[y % to / s.columns.to])
            for (const ResizeTap<Real>& column : columns[y % s.columns.to]) {
                const std::size_t x = y / to * from + row.pixel * s.columns.from + column.pixel;
                const Real value = in[back ? y : x];
                out.add(back ? x : y, row.weight * column.weight * value,
                        row.magnitude * column.magnitude * std::abs(value));
            }
    return out;
}

inline ResizeShape resize_shape(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    return {x.dim(0) * x.dim(1),
            {x.dim(2), in.count("height"), in.attribute("scale_y")},
            {x.dim(3), in.count("width"), in.attribute("scale_x")},
            in.count("filter") == 1,
            in.flag("antialias")};
}

inline OpExample resize2d_example(const Dims& x, std::size_t height, std::size_t width,
                                  const std::string& more = "") {
    return {.inputs = {{x}},
            .outputs = {{x[0], x[1], height, width}},
            .attributes = "{\"height\": " + std::to_string(height) +
                          ", \"width\": " + std::to_string(width) + more + "}"};
}

inline constexpr OpRef kResize2dRef{
    .name = "resize2d",
    .forward = [](const OpArguments& in) -> Sums {
        return {resize2d(resize_shape(in), in.values(0), false)};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {resize2d(resize_shape(in), grads[0], true)};
    },
    .examples =
        [] {
            return std::vector{
                resize2d_example({2, 6, 4, 6}, 7, 9),
                resize2d_example({2, 6, 5, 6}, 3, 4, R"(, "filter": 1, "antialias": true)"),
                resize2d_example({2, 6, 5, 6}, 5, 8, R"(, "filter": 1, "scale_x": 1.35)")};
        },
    .sizes =
        [] {  // what MoGe-2 has: what heads give, its decoder, and the photograph for 1,200 tokens
            return std::vector{
                resize2d_example({1, 3, 480, 640}, 750, 1000),
                resize2d_example({1, 64, 120, 160}, 240, 320),
                resize2d_example({1, 3, 750, 1000}, 420, 560, R"(, "antialias": true)"),
                resize2d_example({1, 384, 37, 37}, 30, 40, R"(, "filter": 1)")};
        }};

}  // namespace splat::ref
