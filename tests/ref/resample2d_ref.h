#pragma once

#include <cstddef>
#include <vector>

#include "ref/summed.h"

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

}  // namespace splat::ref
