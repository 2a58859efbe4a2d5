#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// y[i,j] = x[i - top, j - left], outside of x 0 or the nearest pixel; gradients go back to where y comes from.
namespace splat::ref {

struct PadShape {
    std::size_t planes;
    long height;  ///< size of x
    long width;
    long top;
    long left;
    long new_height;  ///< size of y
    long new_width;
    bool replicate;
};

/// visit(index in y, index in x) for every pixel of y that is one of x.
template <class Visit>
void pad2d_pairs(const PadShape& s, Visit visit) {
    std::size_t at = 0;
    for (std::size_t plane = 0; plane < s.planes; ++plane)
        for (long i = 0; i < s.new_height; ++i)
            for (long j = 0; j < s.new_width; ++j, ++at) {
                const long row = std::clamp(i - s.top, 0L, s.height - 1);
                const long column = std::clamp(j - s.left, 0L, s.width - 1);
                if (s.replicate || (row == i - s.top && column == j - s.left))
                    visit(at, (plane * static_cast<std::size_t>(s.height) +
                               static_cast<std::size_t>(row)) *
                                      static_cast<std::size_t>(s.width) +
                                  static_cast<std::size_t>(column));
            }
}

template <class Real>
Summed<Real> pad2d_forward(const PadShape& s, const std::vector<Real>& x) {
    Summed<Real> y(s.planes * static_cast<std::size_t>(s.new_height * s.new_width), 1);
    pad2d_pairs(s, [&](std::size_t at, std::size_t from) { y.add(at, x[from]); });
    return y;
}

template <class Real>
Summed<Real> pad2d_backward(const PadShape& s, const std::vector<Real>& grad_y) {
    const long copies = std::max(s.new_height - s.height, 0L) + std::max(s.new_width - s.width, 0L);
    Summed<Real> grad_x(s.planes * static_cast<std::size_t>(s.height * s.width),
                        static_cast<std::size_t>(s.replicate ? 1 + copies : 1));
    pad2d_pairs(s, [&](std::size_t at, std::size_t from) { grad_x.add(from, grad_y[at]); });
    return grad_x;
}

inline PadShape pad_shape(const OpArguments& in) {
    const OpTensor& x = in.inputs[0];
    const auto side = [&](const char* name) { return static_cast<long>(in.attribute(name)); };
    const auto height = static_cast<long>(x.dim(2));
    const auto width = static_cast<long>(x.dim(3));
    return {x.dim(0) * x.dim(1),
            height,
            width,
            side("top"),
            side("left"),
            height + side("top") + side("bottom"),
            width + side("left") + side("right"),
            in.flag("replicate")};
}

/// `by` is {left, right, top, bottom}.
inline OpExample pad2d_example(const Dims& x, const std::vector<long>& by, bool replicate) {
    const auto size = [](std::size_t from, long more) {
        return static_cast<std::size_t>(static_cast<long>(from) + more);
    };
    std::string attributes = replicate ? R"({"replicate": true)" : R"({"replicate": false)";
    const char* const names[] = {"left", "right", "top", "bottom"};
    for (std::size_t i = 0; i < 4; ++i)
        attributes += std::string(", \"") + names[i] + "\": " + std::to_string(by[i]);
    return {.inputs = {{x}},
            .outputs = {{x[0], x[1], size(x[2], by[2] + by[3]), size(x[3], by[0] + by[1])}},
            .attributes = attributes + "}"};
}

inline constexpr OpRef kPad2dRef{
    .name = "pad2d",
    .forward = [](const OpArguments& in) -> Sums {
        return {pad2d_forward(pad_shape(in), in.values(0))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {pad2d_backward(pad_shape(in), grads[0])};
    },
    .examples =
        [] {
            return std::vector{pad2d_example({2, 6, 3, 4}, {2, 1, 1, 3}, true),
                               pad2d_example({2, 6, 3, 4}, {1, -2, -1, 2}, false)};
        },
    .sizes =
        [] {
            return std::vector{pad2d_example({1, 64, 128, 128}, {1, 1, 1, 1}, true),
                               pad2d_example({1, 64, 130, 130}, {-1, -1, -1, -1}, false)};
        }};

}  // namespace splat::ref
