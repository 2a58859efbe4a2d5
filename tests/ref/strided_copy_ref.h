#pragma once

#include <cstddef>
#include <vector>

namespace splat::ref {

struct StridedCopy {
    std::size_t count = 0;
    std::size_t channels = 1;
    std::size_t in_stride = 1, in_offset = 0;
    std::size_t out_stride = 1, out_offset = 0;
    bool accumulate = false;
};

/// y[i * out_stride + out_offset + c] (+)= x[i * in_stride + in_offset + c]
template <class Real>
void strided_copy(const StridedCopy& copy, const std::vector<Real>& x, std::vector<Real>& y) {
    for (std::size_t i = 0; i < copy.count; ++i)
        for (std::size_t c = 0; c < copy.channels; ++c) {
            Real& to = y[i * copy.out_stride + copy.out_offset + c];
            const Real from = x[i * copy.in_stride + copy.in_offset + c];
            to = copy.accumulate ? to + from : from;
        }
}

}  // namespace splat::ref
