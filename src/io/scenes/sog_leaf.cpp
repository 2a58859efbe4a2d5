#include "io/scenes/sog_leaf.h"

#include <algorithm>
#include <limits>
#include <numeric>

namespace splat::io {
namespace {

constexpr std::size_t kLanes = 16;
constexpr int kKMeansSteps = 4;  ///< at most; few clusters change after two
constexpr float kFar = std::numeric_limits<float>::infinity();

std::size_t whole_lanes(std::size_t count) {
    return (count + kLanes - 1) / kLanes * kLanes;
}

/// Vectors in blocks of kLanes, a block's numbers of one dimension side by side.
class LaneBlocks {
  public:
    LaneBlocks(std::size_t count, std::size_t dims)
        : dims_(dims), values_(whole_lanes(count) * dims, kFar) {}

    void set(std::size_t i, const float* vector) {
        float* const to = values_.data() + i / kLanes * kLanes * dims_ + i % kLanes;
        for (std::size_t k = 0; k < dims_; ++k) to[k * kLanes] = vector[k];
    }

    /// Squared distances of a vector to those of block b.
    void distances(std::size_t b, const float* vector, float* to) const {
        const float* const block = values_.data() + b * kLanes * dims_;
        float sums[kLanes] = {};
        for (std::size_t k = 0; k < dims_; ++k)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const float d = block[k * kLanes + lane] - vector[k];
                sums[lane] += d * d;
            }
        for (std::size_t lane = 0; lane < kLanes; ++lane) to[lane] = sums[lane];
    }

  private:
    std::size_t dims_;
    std::vector<float> values_;
};

/// The first of the least numbers; the length is a multiple of kLanes.
std::size_t least_of(const float* values, std::size_t count) {
    float least[kLanes];
    for (float& value : least) value = kFar;
    for (std::size_t i = 0; i < count; i += kLanes)
        for (std::size_t lane = 0; lane < kLanes; ++lane)
            least[lane] = values[i + lane] < least[lane] ? values[i + lane] : least[lane];
    const float overall = *std::min_element(least, least + kLanes);
    return static_cast<std::size_t>(std::find(values, values + count, overall) - values);
}

/// What each union of two clusters costs; infinite for clusters that are gone.
class UnionCosts {
  public:
    UnionCosts(const VectorRows& rows, std::span<const std::uint32_t> leaf,
               const std::vector<float>& weights)
        : count_(leaf.size()), width_(whole_lanes(count_)), weights_(weights) {
        weights_.resize(width_);
        costs_.assign(count_ * width_, kFar);
        LaneBlocks blocks(count_, rows.dims);
        for (std::size_t i = 0; i < count_; ++i) blocks.set(i, rows[leaf[i]]);
        for (std::size_t b = 0; b < width_ / kLanes; ++b)
            for (std::size_t i = 0; i < count_; ++i)
                blocks.distances(b, rows[leaf[i]], at(i) + b * kLanes);
        for (std::size_t i = 0; i < count_; ++i) {
            float* const row = at(i);
            for (std::size_t j = 0; j < count_; ++j)
                row[j] *= weights_[i] * weights_[j] / (weights_[i] + weights_[j]);
            for (std::size_t j = count_; j < width_; ++j) row[j] = kFar;
            row[i] = kFar;
        }
    }

    [[nodiscard]] std::size_t nearest(std::size_t i) const { return least_of(at(i), width_); }
    [[nodiscard]] float cost(std::size_t i, std::size_t j) const { return at(i)[j]; }

    /// Cluster `gone` becomes a part of `kept` (Lance and Williams 1967).
    void join(std::size_t kept, std::size_t gone) {
        float* const a = at(kept);
        float* const b = at(gone);
        const float own = a[gone], wa = weights_[kept], wb = weights_[gone];
        for (std::size_t i = 0; i < width_; i += kLanes)
            for (std::size_t lane = 0; lane < kLanes; ++lane) {
                const float w = weights_[i + lane];
                a[i + lane] =
                    ((wa + w) * a[i + lane] + (wb + w) * b[i + lane] - w * own) / (wa + wb + w);
            }
        a[kept] = a[gone] = kFar;
        weights_[kept] = wa + wb;
        weights_[gone] = 0;
        for (std::size_t i = 0; i < count_; ++i) {
            at(i)[kept] = a[i];
            at(i)[gone] = kFar;
        }
    }

  private:
    [[nodiscard]] float* at(std::size_t i) { return costs_.data() + i * width_; }
    [[nodiscard]] const float* at(std::size_t i) const { return costs_.data() + i * width_; }

    std::size_t count_;
    std::size_t width_;
    std::vector<float> weights_;
    std::vector<float> costs_;
};

}  // namespace

std::vector<ClusterUnion> join_clusters(const VectorRows& rows, std::span<const std::uint32_t> leaf,
                                        const std::vector<float>& weights) {
    UnionCosts costs(rows, leaf, weights);
    std::vector<ClusterUnion> unions;
    std::vector<std::size_t> chain;  // each one's nearest is the next, until two are each other's
    std::vector<char> is_there(leaf.size(), 1);
    std::vector<float> formed(leaf.size());  // the cost at which a cluster came to be
    std::size_t first = 0;
    while (unions.size() + 1 < leaf.size()) {
        if (chain.empty()) {
            while (is_there[first] == 0) ++first;
            chain.push_back(first);
        }
        const std::size_t last = chain.back();
        const std::size_t before = chain.size() > 1 ? chain[chain.size() - 2] : leaf.size();
        std::size_t next = costs.nearest(last);
        if (before < leaf.size() && costs.cost(last, before) <= costs.cost(last, next))
            next = before;
        if (next != before) {
            chain.push_back(next);
            continue;
        }
        chain.resize(chain.size() - 2);
        const std::size_t kept = std::min(last, next), gone = std::max(last, next);
        // Rounding may make a union cheaper than those that it needs.
        const float cost = std::max({costs.cost(kept, gone), formed[kept], formed[gone]});
        unions.push_back(
            {cost, static_cast<std::uint16_t>(kept), static_cast<std::uint16_t>(gone)});
        costs.join(kept, gone);
        is_there[gone] = 0;
        formed[kept] = cost;
    }
    std::ranges::stable_sort(unions, {}, &ClusterUnion::cost);
    return unions;
}

VectorPalette improve_clusters(const VectorRows& rows, std::span<const std::uint32_t> leaf,
                               const std::vector<float>& weights,
                               std::span<const ClusterUnion> unions) {
    const std::size_t dims = rows.dims, count = leaf.size() - unions.size();
    std::vector<std::uint32_t> root(leaf.size());
    std::iota(root.begin(), root.end(), 0U);
    for (const ClusterUnion& made : unions) root[made.gone] = made.kept;
    VectorPalette palette;
    palette.labels.resize(leaf.size());
    std::uint32_t found = 0;
    for (std::size_t i = 0; i < leaf.size(); ++i) {  // a root is the lowest of its rows
        if (root[i] == i)
            palette.labels[i] = found++;
        else
            palette.labels[i] = palette.labels[root[i]];
    }
    std::vector<double> sums(count * dims), sizes(count);
    std::vector<float> distances(whole_lanes(count));
    palette.entries.resize(count * dims);
    for (int step = 0;; ++step) {
        std::ranges::fill(sums, 0);
        std::ranges::fill(sizes, 0);
        for (std::size_t i = 0; i < leaf.size(); ++i) {
            const auto weight = static_cast<double>(weights[i]);
            sizes[palette.labels[i]] += weight;
            for (std::size_t k = 0; k < dims; ++k)
                sums[palette.labels[i] * dims + k] +=
                    weight * static_cast<double>(rows[leaf[i]][k]);
        }
        LaneBlocks blocks(count, dims);
        for (std::size_t c = 0; c < count; ++c) {
            float* const entry = &palette.entries[c * dims];
            for (std::size_t k = 0; k < dims && sizes[c] > 0; ++k)
                entry[k] = static_cast<float>(sums[c * dims + k] / sizes[c]);
            blocks.set(c, entry);
        }
        if (step == kKMeansSteps) return palette;
        bool moved = false;
        for (std::size_t i = 0; i < leaf.size(); ++i) {
            for (std::size_t b = 0; b < distances.size() / kLanes; ++b)
                blocks.distances(b, rows[leaf[i]], &distances[b * kLanes]);
            const auto label =
                static_cast<std::uint32_t>(least_of(distances.data(), distances.size()));
            moved = moved || distances[label] < distances[palette.labels[i]];
            if (distances[label] < distances[palette.labels[i]]) palette.labels[i] = label;
        }
        if (!moved) return palette;
    }
}

}  // namespace splat::io
