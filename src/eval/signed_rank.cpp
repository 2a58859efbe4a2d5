#include "eval/signed_rank.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

namespace splat::eval {
namespace {

/// With more, a normal distribution is as good (scipy draws the line there, too); 2^50 counts are exact in a double.
constexpr std::size_t kExact = 50;
constexpr double kSameSize = 1e-12;

/// The probability of a sum of numbers, each taken or not, of at most `most`.
double sum_at_most(const std::vector<std::size_t>& numbers, std::size_t most) {
    std::vector<double> ways(std::reduce(numbers.begin(), numbers.end()) + 1);  // by the sum
    ways[0] = 1;
    for (const std::size_t number : numbers)
        for (std::size_t sum = ways.size() - 1; sum >= number; --sum)
            ways[sum] += ways[sum - number];
    double part = 0;
    for (std::size_t sum = 0; sum <= most; ++sum) part += ways[sum];
    return std::ldexp(part, -static_cast<int>(numbers.size()));
}

}  // namespace

RankTest signed_rank_test(std::span<const double> a, std::span<const double> b) {
    RankTest test;
    std::vector<double> differences;
    double largest = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
        largest = std::max({largest, std::abs(a[i]), std::abs(b[i])});
        if (a[i] != b[i]) differences.push_back(b[i] - a[i]);
    }
    test.n = differences.size();
    if (test.n == 0) return test;
    std::ranges::sort(differences, {}, [](double d) { return std::abs(d); });
    std::vector<std::size_t> doubled;  // ranks times 2, which are whole where sizes are equal, too
    double ties = 0;                   // sum of t^3 - t over groups of t equal sizes
    for (std::size_t first = 0, end = 0; first < test.n; first = end) {
        const double size = std::abs(differences[first]) + kSameSize * largest;
        for (end = first; end < test.n && std::abs(differences[end]) <= size;) ++end;
        const auto t = static_cast<double>(end - first);
        ties += t * t * t - t;
        for (std::size_t i = first; i < end; ++i) {
            doubled.push_back(first + 1 + end);  // ranks begin at 1
            if (differences[i] > 0) test.positive += static_cast<double>(doubled.back()) / 2;
        }
    }
    const auto n = static_cast<double>(test.n);
    const double middle = n * (n + 1) / 4;
    const double away = std::abs(test.positive - middle);
    test.tied = ties > 0;
    test.exact = test.n <= kExact;
    if (test.exact) {
        const auto most = static_cast<std::size_t>(2 * (middle - away));
        test.p = std::min(1.0, 2 * sum_at_most(doubled, most));
    } else {
        const double variance = n * (n + 1) * (2 * n + 1) / 24 - ties / 48;
        test.p = std::erfc(away / std::sqrt(2 * variance));
    }
    return test;
}

void Wins::count(double of_a, double of_b, bool less_is_better) {
    if (of_a == of_b)
        ++ties;
    else
        ++((of_b > of_a) != less_is_better ? b : a);
}

}  // namespace splat::eval
