#include "io/scenes/sog_codebook.h"

#include <algorithm>
#include <limits>

namespace splat::io {
namespace {

constexpr std::size_t kMaxGroups = 2048;

/// Sums over the first values, in groups of neighbours, from which the cost of any range follows.
class ValueGroups {
  public:
    ValueGroups(const std::vector<float>& sorted, std::size_t distinct) : middle_(mean_of(sorted)) {
        const auto low = static_cast<double>(sorted.front());
        const double range = static_cast<double>(sorted.back()) - low;
        std::size_t group = 0;
        Sums sums;
        for (std::size_t i = 0; i < sorted.size(); ++i) {
            const auto value = static_cast<double>(sorted[i]);
            if (distinct <= kMaxGroups) {
                if (i > 0 && sorted[i] != sorted[i - 1]) close(sums);
            } else {  // half the groups by value, half by rank: neither tails nor the middle are coarse
                const double place =
                    0.5 * (value - low) / range +
                    0.5 * static_cast<double>(i) / static_cast<double>(sorted.size());
                const auto next = static_cast<std::size_t>(place * (kMaxGroups - 1));
                if (i > 0 && next != group) close(sums);
                group = next;
            }
            sums.count += 1;
            sums.value += value - middle_;
            sums.square += (value - middle_) * (value - middle_);
        }
        close(sums);
    }

    [[nodiscard]] std::size_t count() const { return before_.size() - 1; }

    /// Sum of squared distances of groups first .. last - 1 to their mean.
    [[nodiscard]] double cost(std::size_t first, std::size_t last) const {
        const double value = before_[last].value - before_[first].value;
        return before_[last].square - before_[first].square -
               value * value / (before_[last].count - before_[first].count);
    }
    [[nodiscard]] float mean(std::size_t first, std::size_t last) const {
        return static_cast<float>(middle_ + (before_[last].value - before_[first].value) /
                                                (before_[last].count - before_[first].count));
    }

  private:
    struct Sums {
        double count = 0, value = 0, square = 0;
    };

    static double mean_of(const std::vector<float>& values) {
        double sum = 0;
        for (const float value : values) sum += static_cast<double>(value);
        return sum / static_cast<double>(values.size());
    }

    void close(const Sums& sums) { before_.push_back(sums); }

    double middle_;
    std::vector<Sums> before_ = {Sums()};
};

/// The best cuts of groups into `levels` ranges, level by level.
class BestCuts {
  public:
    BestCuts(const ValueGroups& groups, std::size_t levels)
        : groups_(groups), cuts_(levels, std::vector<std::uint16_t>(groups.count() + 1)) {
        costs_.resize(groups.count() + 1);
        for (std::size_t last = 1; last <= groups.count(); ++last)
            costs_[last] = groups.cost(0, last);
        for (std::size_t level = 1; level < levels; ++level) {
            next_.assign(groups.count() + 1, std::numeric_limits<double>::infinity());
            search(level, level + 1, groups.count(), level, groups.count() - 1);
            costs_.swap(next_);
        }
    }

    /// Where the range of a level that ends before `last` begins.
    [[nodiscard]] std::size_t start(std::size_t level, std::size_t last) const {
        return cuts_[level][last];
    }

  private:
    /// For each end from `low` to `high` the best cut, which never moves back when the end moves on.
    void search(std::size_t level, std::size_t low, std::size_t high, std::size_t first,
                std::size_t most) {
        if (low > high) return;
        const std::size_t last = (low + high) / 2;
        std::size_t best = first;
        for (std::size_t cut = first; cut <= std::min(most, last - 1); ++cut) {
            const double cost = costs_[cut] + groups_.cost(cut, last);
            if (cost < next_[last]) {
                next_[last] = cost;
                best = cut;
            }
        }
        cuts_[level][last] = static_cast<std::uint16_t>(best);
        search(level, low, last - 1, first, best);
        search(level, last + 1, high, best, most);
    }

    const ValueGroups& groups_;
    std::vector<std::vector<std::uint16_t>> cuts_;
    std::vector<double> costs_;
    std::vector<double> next_;
};

}  // namespace

Codebook make_codebook(std::vector<float> values) {
    Codebook codebook{};
    if (values.empty()) return codebook;
    std::ranges::sort(values);
    std::vector<float> distinct = values;
    distinct.erase(std::unique(distinct.begin(), distinct.end()), distinct.end());
    if (distinct.size() <= codebook.size()) {
        codebook.fill(distinct.back());
        std::ranges::copy(distinct, codebook.begin());
        return codebook;
    }
    const ValueGroups groups(values, distinct.size());
    const std::size_t levels = std::min(groups.count(), codebook.size());
    const BestCuts cuts(groups, levels);
    std::size_t last = groups.count();
    for (std::size_t level = levels; level-- > 0;) {
        const std::size_t first = cuts.start(level, last);
        codebook[level] = groups.mean(first, last);
        last = first;
    }
    std::fill(codebook.begin() + static_cast<std::ptrdiff_t>(levels), codebook.end(),
              codebook[levels - 1]);
    return codebook;
}

std::uint8_t nearest_code(const Codebook& codebook, float value) {
    const auto above = std::ranges::lower_bound(codebook, value);
    if (above == codebook.begin()) return 0;
    const auto place = static_cast<std::uint8_t>(above - codebook.begin() - 1);
    if (above == codebook.end()) return place;
    return value - *(above - 1) <= *above - value ? place : static_cast<std::uint8_t>(place + 1);
}

}  // namespace splat::io
