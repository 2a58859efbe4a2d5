#include "io/scenes/sog_palette.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/parallel.h"
#include "io/scenes/sog_leaf.h"

namespace splat::io {
namespace {

constexpr std::size_t kSampled = 4096;  ///< rows that tell the principal axis of a node
constexpr int kAxisSteps = 8;  ///< power iterations: an axis near the principal one suffices

/// Rows that differ, each with the number of its equals.
struct DistinctRows {
    std::vector<std::uint32_t> first;   ///< the lowest row of each
    std::vector<float> weights;         ///< how many rows are equal to it
    std::vector<std::uint32_t> of_row;  ///< [count] the place in `first`
};

std::uint64_t row_hash(const float* row, std::size_t dims) {
    std::uint64_t hash = dims;
    for (std::size_t k = 0; k < dims; ++k) {
        std::uint32_t bits = 0;
        std::memcpy(&bits, row + k, sizeof bits);
        hash = (hash ^ bits) * 0x9E3779B97F4A7C15ULL;
        hash ^= hash >> 32U;
    }
    return hash;
}

DistinctRows find_distinct(const VectorRows& rows) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> hashes(rows.count);
    for (std::size_t i = 0; i < rows.count; ++i)
        hashes[i] = {row_hash(rows[i], rows.dims), static_cast<std::uint32_t>(i)};
    std::ranges::sort(hashes);
    // Equal rows have equal hashes, so they are neighbours here. A collision between them only costs an entry.
    std::vector<std::uint32_t> lowest(rows.count);
    for (std::size_t i = 0; i < hashes.size(); ++i) {
        const std::uint32_t row = hashes[i].second;
        const std::uint32_t before = i > 0 ? lowest[hashes[i - 1].second] : row;
        const bool equal = i > 0 && hashes[i].first == hashes[i - 1].first &&
                           std::equal(rows[row], rows[row] + rows.dims, rows[before]);
        lowest[row] = equal ? before : row;
    }
    DistinctRows distinct;
    distinct.of_row.resize(rows.count);
    for (std::uint32_t i = 0; i < rows.count; ++i) {
        if (lowest[i] == i) {
            distinct.of_row[i] = static_cast<std::uint32_t>(distinct.first.size());
            distinct.first.push_back(i);
            distinct.weights.push_back(0);
        } else {
            distinct.of_row[i] = distinct.of_row[lowest[i]];
        }
        distinct.weights[distinct.of_row[i]] += 1;
    }
    return distinct;
}

using RowSpan = std::span<std::uint32_t>;
using Axis = std::array<double, kMaxPaletteDims>;

/// An axis along which the rows differ much, by power iteration of their covariance.
Axis principal_axis(const VectorRows& rows, RowSpan node) {
    const std::size_t step = (node.size() + kSampled - 1) / kSampled;
    const double sampled = static_cast<double>((node.size() + step - 1) / step);
    Axis mean{}, axis{};
    const auto each = [&](const auto& visit) {
        for (std::size_t i = 0; i < node.size(); i += step) visit(rows[node[i]]);
    };
    each([&](const float* row) {
        for (std::size_t k = 0; k < rows.dims; ++k)
            mean[k] += static_cast<double>(row[k]) / sampled;
    });
    each([&](const float* row) {
        for (std::size_t k = 0; k < rows.dims; ++k)
            axis[k] += std::pow(static_cast<double>(row[k]) - mean[k], 2);
    });
    for (int i = 0; i < kAxisSteps; ++i) {
        Axis next{};
        each([&](const float* row) {
            double along = 0;
            for (std::size_t k = 0; k < rows.dims; ++k)
                along += (static_cast<double>(row[k]) - mean[k]) * axis[k];
            for (std::size_t k = 0; k < rows.dims; ++k)
                next[k] += along * (static_cast<double>(row[k]) - mean[k]);
        });
        double largest = 0;
        for (const double value : next) largest = std::max(largest, std::abs(value));
        if (largest == 0) break;
        for (std::size_t k = 0; k < rows.dims; ++k) axis[k] = next[k] / largest;
    }
    return axis;
}

/// Halves of the rows, below and above the median along the axis.
void split(const VectorRows& rows, RowSpan node) {
    const Axis axis = principal_axis(rows, node);
    std::vector<std::pair<double, std::uint32_t>> places(node.size());
    for (std::size_t i = 0; i < node.size(); ++i) {
        double along = 0;
        for (std::size_t k = 0; k < rows.dims; ++k)
            along += static_cast<double>(rows[node[i]][k]) * axis[k];
        places[i] = {along, node[i]};
    }
    std::nth_element(places.begin(), places.begin() + std::ssize(places) / 2, places.end());
    std::sort(places.begin(), places.begin() + std::ssize(places) / 2,
              [](const auto& a, const auto& b) { return a.second < b.second; });
    std::sort(places.begin() + std::ssize(places) / 2, places.end(),
              [](const auto& a, const auto& b) { return a.second < b.second; });
    for (std::size_t i = 0; i < node.size(); ++i) node[i] = places[i].second;
}

/// Cuts all rows into leaves of neighbours.
std::vector<RowSpan> make_leaves(const VectorRows& rows, std::vector<std::uint32_t>& order,
                                 std::size_t threads) {
    std::vector<RowSpan> nodes{RowSpan(order)};
    while (nodes.front().size() > kMaxLeafRows) {  // all nodes of a level differ by one row at most
        static_cast<void>(parallel_for(nodes.size(), threads, [&](std::size_t i) -> Status {
            split(rows, nodes[i]);
            return {};
        }));
        std::vector<RowSpan> halves;
        for (const RowSpan node : nodes) {
            halves.push_back(node.subspan(node.size() / 2));  // the larger one is first
            halves.push_back(node.first(node.size() / 2));
        }
        nodes = std::move(halves);
    }
    return nodes;
}

/// How many unions each leaf makes, so that `wanted` of all leaves cost least.
std::vector<std::size_t> share_unions(const std::vector<std::vector<ClusterUnion>>& unions,
                                      std::size_t wanted) {
    struct Cost {
        float cost;
        std::uint32_t leaf;
    };
    std::vector<Cost> costs;
    for (std::uint32_t leaf = 0; leaf < unions.size(); ++leaf)
        for (const ClusterUnion& made : unions[leaf]) costs.push_back({made.cost, leaf});
    const auto cheaper = [](const Cost& a, const Cost& b) {
        return a.cost != b.cost ? a.cost < b.cost : a.leaf < b.leaf;
    };
    wanted = std::min(wanted, costs.size());
    std::nth_element(costs.begin(), costs.begin() + static_cast<std::ptrdiff_t>(wanted),
                     costs.end(), cheaper);
    std::vector<std::size_t> share(unions.size());
    for (std::size_t i = 0; i < wanted; ++i) ++share[costs[i].leaf];
    return share;
}

}  // namespace

VectorPalette make_palette(const VectorRows& rows, std::size_t most, std::size_t threads) {
    VectorPalette palette;
    palette.labels.resize(rows.count);
    if (rows.count == 0) return palette;
    const DistinctRows distinct = find_distinct(rows);
    std::vector<std::uint32_t> label_of(distinct.first.size());
    const auto put_entry = [&](const float* entry) {
        palette.entries.insert(palette.entries.end(), entry, entry + rows.dims);
    };
    if (distinct.first.size() <= most) {
        for (const std::uint32_t row : distinct.first) put_entry(rows[row]);
        palette.labels = distinct.of_row;
        return palette;
    }
    std::vector<std::uint32_t> order = distinct.first;
    const std::vector<RowSpan> nodes = make_leaves(rows, order, threads);
    const auto weights_of = [&](RowSpan node) {
        std::vector<float> weights;
        for (const std::uint32_t row : node)
            weights.push_back(distinct.weights[distinct.of_row[row]]);
        return weights;
    };
    std::vector<std::vector<ClusterUnion>> unions(nodes.size());
    const auto for_leaves = [&](const std::function<void(std::size_t)>& work) {
        static_cast<void>(parallel_for(nodes.size(), threads, [&](std::size_t i) -> Status {
            work(i);
            return {};
        }));
    };
    for_leaves(
        [&](std::size_t i) { unions[i] = join_clusters(rows, nodes[i], weights_of(nodes[i])); });
    const std::vector<std::size_t> share = share_unions(unions, distinct.first.size() - most);
    std::vector<VectorPalette> parts(nodes.size());
    for_leaves([&](std::size_t i) {
        parts[i] =
            improve_clusters(rows, nodes[i], weights_of(nodes[i]), {unions[i].data(), share[i]});
    });
    for (std::size_t i = 0; i < nodes.size(); ++i) {
        const auto before = static_cast<std::uint32_t>(palette.size(rows.dims));
        palette.entries.insert(palette.entries.end(), parts[i].entries.begin(),
                               parts[i].entries.end());
        for (std::size_t j = 0; j < nodes[i].size(); ++j)
            label_of[distinct.of_row[nodes[i][j]]] = before + parts[i].labels[j];
    }
    for (std::size_t i = 0; i < rows.count; ++i) palette.labels[i] = label_of[distinct.of_row[i]];
    return palette;
}

}  // namespace splat::io
