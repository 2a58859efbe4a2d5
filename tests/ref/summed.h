#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

namespace splat::ref {

/// A tensor of sums, with the numbers that bound the rounding of a float32 computation of each.
///
/// For value = t1 + ... + tK: magnitude S = |t1| + ... + |tK|. Where a term is itself computed with
/// an error, S holds the first-order effect of that error too, so that |gpu - value| <= c * 2^-24 *
/// (1 + sqrt(K)) * S is a bound that correct kernels meet.
template <class Real>
struct Summed {
    std::vector<Real> value;
    std::vector<Real> magnitude;  ///< S, one per element
    std::size_t terms = 1;        ///< K, the same for all elements

    Summed() = default;
    Summed(std::size_t elements, std::size_t term_count)
        : value(elements, Real(0)), magnitude(elements, Real(0)), terms(term_count) {}

    void add(std::size_t element, Real term) { add(element, term, std::abs(term)); }
    void add(std::size_t element, Real term, Real term_magnitude) {
        value[element] += term;
        magnitude[element] += term_magnitude;
    }
};

}  // namespace splat::ref
