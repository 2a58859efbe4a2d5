#include "prior_scores/edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "prior_scores/check_map.h"

namespace splat::prior_scores {
namespace {

enum class Border { kReflect, kRepeat };

/// The place inside of 0 to count - 1 that stands for one at most 1 outside.
std::size_t place_inside(std::size_t i, int step, std::size_t count, Border border) {
    const auto at = static_cast<std::int64_t>(i) + step;
    const auto last = static_cast<std::int64_t>(count) - 1;
    if (at >= 0 && at <= last) return static_cast<std::size_t>(at);
    if (border == Border::kRepeat || last == 0) return i;
    return static_cast<std::size_t>(at < 0 ? 1 : last - 1);
}

/// A map and its 3 x 3 derivatives.
template <class T>
struct Derivatives {
    std::vector<T> map;
    std::size_t height, width;
    std::array<T, 3> weights;
    Border border;

    [[nodiscard]] T dx(std::size_t y, std::size_t x) const {
        T sum = 0;
        for (int i = -1; i <= 1; ++i) sum += weight(i) * (at(y, x, i, 1) - at(y, x, i, -1));
        return sum;
    }
    [[nodiscard]] T dy(std::size_t y, std::size_t x) const {
        T sum = 0;
        for (int i = -1; i <= 1; ++i) sum += weight(i) * (at(y, x, 1, i) - at(y, x, -1, i));
        return sum;
    }

  private:
    [[nodiscard]] T weight(int i) const { return weights[static_cast<std::size_t>(i + 1)]; }
    [[nodiscard]] T at(std::size_t y, std::size_t x, int down, int right) const {
        return map[place_inside(y, down, height, border) * width +
                   place_inside(x, right, width, border)];
    }
};

constexpr int kLow = 50;
constexpr int kHigh = 150;

/// Lengths of the gradient, with a border of zeros.
struct Lengths {
    std::size_t width;
    std::vector<int> values;

    [[nodiscard]] int at(std::size_t y, std::size_t x, int down, int right) const {
        const auto row = static_cast<std::int64_t>(y) + 1 + down;
        const auto column = static_cast<std::int64_t>(x) + 1 + right;
        return values[static_cast<std::size_t>(row) * (width + 2) +
                      static_cast<std::size_t>(column)];
    }
};

/// True if the length is larger than those before and behind it along the gradient. Of two equal neighbours
/// along an axis, the second in order counts.
bool is_ridge(const Lengths& lengths, std::size_t y, std::size_t x, int dx, int dy) {
    constexpr std::int64_t kTan22 = 13573;  // tan(22.5 degrees) 2^15; tan(67.5 degrees) is 2 more
    const int length = lengths.at(y, x, 0, 0);
    const std::int64_t across = std::abs(dx);
    const std::int64_t down = std::int64_t{std::abs(dy)} << 15;
    if (down < across * kTan22)
        return length > lengths.at(y, x, 0, -1) && length >= lengths.at(y, x, 0, 1);
    if (down > across * kTan22 + (across << 16))
        return length > lengths.at(y, x, -1, 0) && length >= lengths.at(y, x, 1, 0);
    const int side = (dx ^ dy) < 0 ? -1 : 1;
    return length > lengths.at(y, x, -1, -side) && length > lengths.at(y, x, 1, side);
}

/// Keep the pixels of `candidates` that are joined to one in `strong`, over 8 neighbours.
std::vector<std::uint8_t> joined(const std::vector<std::uint8_t>& candidates,
                                 std::vector<std::size_t> strong, std::size_t height,
                                 std::size_t width) {
    std::vector<std::uint8_t> edges(candidates.size());
    for (const std::size_t i : strong) edges[i] = 1;
    while (!strong.empty()) {
        const std::size_t y = strong.back() / width;
        const std::size_t x = strong.back() % width;
        strong.pop_back();
        for (std::size_t row = y - (y > 0 ? 1 : 0); row < std::min(y + 2, height); ++row)
            for (std::size_t column = x - (x > 0 ? 1 : 0); column < std::min(x + 2, width);
                 ++column) {
                const std::size_t i = row * width + column;
                if (candidates[i] == 0 || edges[i] != 0) continue;
                edges[i] = 1;
                strong.push_back(i);
            }
    }
    return edges;
}

}  // namespace

Result<std::vector<double>> gradient_length(std::span<const float> map, std::uint32_t height,
                                            std::uint32_t width, Gradient kind) {
    SPLAT_TRY(check_map(map, std::size_t{height} * width, "the map"));
    const std::array<double, 3> weights = kind == Gradient::kSobel    ? std::array{1.0, 2.0, 1.0}
                                          : kind == Gradient::kScharr ? std::array{3.0, 10.0, 3.0}
                                                                      : std::array{1.0, 1.0, 1.0};
    const Derivatives<double> of{
        {map.begin(), map.end()}, height, width, weights, Border::kReflect};
    std::vector<double> lengths;
    lengths.reserve(map.size());
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            lengths.push_back(std::hypot(of.dx(y, x), of.dy(y, x)));
    const double most = *std::ranges::max_element(lengths) + 1e-8;
    for (double& length : lengths) length /= most;
    return lengths;
}

Result<std::vector<std::uint8_t>> canny_edges(std::span<const float> map, std::uint32_t height,
                                              std::uint32_t width) {
    SPLAT_TRY(check_unit_map(map, std::size_t{height} * width, "the map"));
    Derivatives<int> bytes{{}, height, width, {1, 2, 1}, Border::kRepeat};
    for (const float value : map) bytes.map.push_back(static_cast<int>(255 * value));
    Lengths lengths{width, std::vector<int>((std::size_t{height} + 2) * (std::size_t{width} + 2))};
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x)
            lengths.values[(y + 1) * (width + 2) + x + 1] =
                std::abs(bytes.dx(y, x)) + std::abs(bytes.dy(y, x));
    std::vector<std::uint8_t> candidates(map.size());
    std::vector<std::size_t> strong;
    for (std::size_t y = 0; y < height; ++y)
        for (std::size_t x = 0; x < width; ++x) {
            const int length = lengths.at(y, x, 0, 0);
            if (length <= kLow || !is_ridge(lengths, y, x, bytes.dx(y, x), bytes.dy(y, x)))
                continue;
            candidates[y * width + x] = 1;
            if (length > kHigh) strong.push_back(y * width + x);
        }
    return joined(candidates, std::move(strong), height, width);
}

}  // namespace splat::prior_scores
