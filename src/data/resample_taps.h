#pragma once

#include <cstdint>
#include <vector>

#include "data/resample.h"

namespace splat::data {

/// The samples that contribute to one new sample, and their weights.
struct Taps {
    std::size_t first = 0;
    std::vector<double> weights;
};

/// Weights of each new sample: Pillow's kernels, widened by a reduction, with a sum of 1.
std::vector<Taps> pillow_taps(std::uint32_t from, std::uint32_t to, Filter filter);

}  // namespace splat::data
