#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "io/scenes/sog_palette.h"

namespace splat::io {

inline constexpr std::size_t kMaxPaletteDims = 48;
inline constexpr std::size_t kMaxLeafRows = 512;  ///< a matrix of their distances takes 1 MB

/// Two clusters of a leaf become one, which takes the place of `kept`. A cluster is named by one of its rows.
struct ClusterUnion {
    float
        cost;  ///< what it adds to the sum of squared distances; never less than in an earlier one
    std::uint16_t kept;
    std::uint16_t gone;
};

/// All unions of the rows `leaf`, at most kMaxLeafRows, from the cheapest on (Ward 1963, by the chain of nearest
/// neighbours: Murtagh 1983). `weights` are how often each row counts.
std::vector<ClusterUnion> join_clusters(const VectorRows& rows, std::span<const std::uint32_t> leaf,
                                        const std::vector<float>& weights);

/// The clusters after these unions, improved by k-means. Labels are those of the leaf's rows.
VectorPalette improve_clusters(const VectorRows& rows, std::span<const std::uint32_t> leaf,
                               const std::vector<float>& weights,
                               std::span<const ClusterUnion> unions);

}  // namespace splat::io
