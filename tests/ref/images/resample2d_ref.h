#pragma once

#include <cstddef>
#include <vector>

#include "ref/op_ref.h"

/// Resampling by 2 with F = outer(f, f) / sum(f)^2 and p = (taps - 1) / 2; both directions walk over
/// the pairs (small image at i, large image at 2i + r - p), and the gradient of one is the other:
///
///   down  small[i,j] += F[r,s] large[2i + r - p, 2j + s - p]
///   up    large[2i + r - p, 2j + s - p] += 4 F[r,s] small[i,j]
namespace splat::ref {

struct ResampleShape {
    std::size_t planes = 1;  ///< N * C
    std::size_t height = 1;  ///< size of the small image
    std::size_t width = 1;
};

/// visit(small index, large index, F) for every pair inside both images.
template <class Real, class Visit>
void resample2d_pairs(const ResampleShape& shape, const std::vector<Real>& filter, Visit visit) {
    const auto [planes, height, width] = shape;
    const std::size_t taps = filter.size();
    const std::size_t pad = (taps - 1) / 2;
    Real sum = 0;
    for (const Real tap : filter) sum += tap;
    for (std::size_t plane = 0; plane < planes; ++plane)
        for (std::size_t i = 0; i < height; ++i)
            for (std::size_t j = 0; j < width; ++j)
                for (std::size_t r = 0; r < taps; ++r)
                    for (std::size_t s = 0; s < taps; ++s) {
                        const std::size_t row =
                            2 * i + r - pad;  // wraps to outside above the image
                        const std::size_t column = 2 * j + s - pad;
                        if (row < 2 * height && column < 2 * width)
                            visit((plane * height + i) * width + j,
                                  (plane * 2 * height + row) * 2 * width + column,
                                  filter[r] * filter[s] / (sum * sum));
                    }
}

template <class Real>
Summed<Real> resample2d_down(const ResampleShape& shape, const std::vector<Real>& filter, Real gain,
                             const std::vector<Real>& large) {
    Summed<Real> small(shape.planes * shape.height * shape.width, filter.size() * filter.size());
    resample2d_pairs(shape, filter, [&](std::size_t at, std::size_t from, Real factor) {
        small.add(at, gain * factor * large[from]);
    });
    return small;
}

template <class Real>
Summed<Real> resample2d_up(const ResampleShape& shape, const std::vector<Real>& filter, Real gain,
                           const std::vector<Real>& small) {
    Summed<Real> large(4 * shape.planes * shape.height * shape.width,
                       filter.size() * filter.size());
    resample2d_pairs(shape, filter, [&](std::size_t from, std::size_t at, Real factor) {
        large.add(at, gain * factor * small[from]);
    });
    return large;
}

/// `from` is the small image if `up`, else the large one. The backward pass of up is down.
inline Summed<double> resample2d(const OpArguments& in, const Values& from, bool up) {
    const OpTensor& x = in.inputs[0];
    const std::size_t divisor = in.flag("up") ? 1 : 2;
    const ResampleShape small{x.dim(0) * x.dim(1), x.dim(2) / divisor, x.dim(3) / divisor};
    const Values filter = in.values(1).empty() ? Values{1, 1} : in.values(1);
    const double gain = in.flag("up") ? 4 : 1;
    return up ? resample2d_up(small, filter, gain, from)
              : resample2d_down(small, filter, gain, from);
}

inline OpExample resample2d_example(const Dims& x, bool up) {
    return {.inputs = {{x}, {{}, 0, 1, true}},
            .outputs = {{x[0], x[1], up ? 2 * x[2] : x[2] / 2, up ? 2 * x[3] : x[3] / 2}},
            .attributes = up ? R"({"up": true})" : R"({"down": true})"};
}

inline constexpr OpRef kResample2dRef{
    .name = "resample2d",
    .forward = [](const OpArguments& in) -> Sums {
        return {resample2d(in, in.values(0), in.flag("up"))};
    },
    .backward = [](const OpArguments& in, const Grads& grads) -> Sums {
        return {resample2d(in, grads[0], !in.flag("up")), {}};
    },
    .examples =
        [] {
            std::vector both = {resample2d_example({2, 6, 4, 6}, true),
                                resample2d_example({2, 6, 4, 6}, false)};
            both[0].inputs[1].dims = {4};
            both[0].change = [](std::vector<std::vector<float>>& inputs) {
                inputs[1] = {1, 3, 3, 1};
            };
            return both;
        },
    .sizes =
        [] {
            return std::vector{resample2d_example({1, 256, 32, 32}, true),
                               resample2d_example({1, 128, 128, 128}, false)};
        }};

}  // namespace splat::ref
