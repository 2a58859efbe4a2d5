#include "eval/significance.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numeric>
#include <random>

namespace splat::eval {
namespace {

constexpr std::size_t kExactPairs = 20;
/// Sums of the same numbers in another order differ by rounding; they count as equal.
constexpr double kRounding = 1e-12;

double squares(std::span<const double> values) {
    const double middle = mean(values);
    double sum = 0;
    for (const double value : values) sum += (value - middle) * (value - middle);
    return sum;
}

double cubes(std::span<const double> values) {
    const double middle = mean(values);
    double sum = 0;
    for (const double value : values) sum += std::pow(value - middle, 3);
    return sum;
}

/// The acceleration of BCa from sums of cubes and squares of the jackknife's influences; 0 without deviation.
double acceleration(double third, double second) {
    return second > 0 ? third / (6 * std::pow(second, 1.5)) : 0;
}

/// The probability that a standard normal number is below x.
double normal_below(double x) {
    return std::erfc(-x / std::sqrt(2.0)) / 2;
}

/// The number that normal_below() takes to `part`, by bisection; infinite for 0 and 1.
double normal_quantile(double part) {
    if (part <= 0 || part >= 1) return std::copysign(INFINITY, part - 0.5);
    double low = -40, high = 40;
    for (int i = 0; i < 100; ++i) {
        const double middle = (low + high) / 2;
        (normal_below(middle) < part ? low : high) = middle;
    }
    return low;
}

/// Numbers that do not depend on the standard library, whose distributions do.
class Numbers {
  public:
    explicit Numbers(std::uint64_t seed) : engine_(seed) {}

    /// 0 to count - 1; the bias of 2^-32 count is far below that of so few resamples.
    std::size_t below(std::size_t count) {
        return static_cast<std::size_t>((engine_() >> 32) * count >> 32);
    }
    std::uint64_t bits() { return engine_(); }

  private:
    std::mt19937_64 engine_;
};

/// Intervals of 95 % from differences of means of samples with replacement; those within `rounding` are equal.
template <class Draw>
void find_intervals(std::uint32_t count, double skew, double rounding, Draw&& draw,
                    Comparison& result) {
    std::vector<double> means(std::max<std::uint32_t>(count, 1));
    double below = 0;
    for (double& value : means) {
        value = draw();
        const double apart = value - result.difference;
        below += std::abs(apart) <= rounding ? 0.5 : apart < 0 ? 1 : 0;
    }
    std::ranges::sort(means);
    const auto at = [&means](double part) {
        return means[static_cast<std::size_t>(
            std::lround(part * static_cast<double>(means.size() - 1)))];
    };
    result.low = at(0.025);
    result.high = at(0.975);
    const double bias = normal_quantile(below / static_cast<double>(means.size()));
    const auto bca = [&](double normal) -> double {
        const double shifted = bias + normal;
        const double stretch = 1 - skew * shifted;
        if (!std::isfinite(bias) || stretch <= 0) return NAN;
        return at(normal_below(bias + shifted / stretch));
    };
    constexpr double kNormal = 1.959963984540054;  // 97.5 % of normal numbers are below
    result.bca_low = bca(-kNormal);
    result.bca_high = bca(kNormal);
}

double resampled_mean(std::span<const double> values, Numbers& numbers) {
    double sum = 0;
    for (std::size_t i = 0; i < values.size(); ++i) sum += values[numbers.below(values.size())];
    return sum / static_cast<double>(values.size());
}

/// Counts sums of all flips of signs, in the order of a Gray code, so that each differs by one.
double exact_flips(std::vector<double> d, double threshold) {
    double sum = std::accumulate(d.begin(), d.end(), 0.0);
    const std::uint64_t all = std::uint64_t{1} << d.size();
    std::uint64_t extreme = 0;
    for (std::uint64_t i = 1; i <= all; ++i) {
        if (std::abs(sum) >= threshold) ++extreme;
        if (i == all) break;
        double& flipped = d[static_cast<std::size_t>(std::countr_zero(i))];
        sum -= 2 * flipped;
        flipped = -flipped;
    }
    return static_cast<double>(extreme) / static_cast<double>(all);
}

double random_flips(const std::vector<double>& d, double threshold, std::uint32_t count,
                    Numbers& numbers) {
    std::uint64_t extreme = 0;
    for (std::uint32_t k = 0; k < count; ++k) {
        double sum = 0;
        std::uint64_t bits = 0;
        for (std::size_t i = 0; i < d.size(); ++i) {
            if (i % 64 == 0) bits = numbers.bits();
            sum += (bits & 1U) != 0 ? d[i] : -d[i];
            bits >>= 1;
        }
        if (std::abs(sum) >= threshold) ++extreme;
    }
    return (1.0 + static_cast<double>(extreme)) / (1.0 + count);
}

/// The regularised incomplete beta function by its continued fraction (Lentz's method).
double incomplete_beta(double a, double b, double x) {
    if (x <= 0) return 0;
    if (x >= 1) return 1;
    if (x > (a + 1) / (a + b + 2)) return 1 - incomplete_beta(b, a, 1 - x);
    const double front = std::exp(std::lgamma(a + b) - std::lgamma(a) - std::lgamma(b) +
                                  a * std::log(x) + b * std::log1p(-x)) /
                         a;
    double c = 1;
    double d = 1 / (1 - (a + b) * x / (a + 1));
    double fraction = d;
    for (int m = 1; m < 500; ++m) {
        const double even = m * (b - m) * x / ((a + 2 * m - 1) * (a + 2 * m));
        const double odd = -(a + m) * (a + b + m) * x / ((a + 2 * m) * (a + 2 * m + 1));
        double factor = 1;
        for (const double term : {even, odd}) {
            d = 1 / (1 + term * d);
            c = 1 + term / c;
            factor = c * d;
            fraction *= factor;
        }
        if (std::abs(factor - 1) < 1e-15) break;
    }
    return front * fraction;
}

}  // namespace

double mean(std::span<const double> values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

double student_two_sided(double t, double degrees) {
    return incomplete_beta(degrees / 2, 0.5, degrees / (degrees + t * t));
}

Comparison compare_paired(std::span<const double> a, std::span<const double> b,
                          const ResampleOptions& options) {
    Comparison result;
    const std::size_t n = std::min(a.size(), b.size());
    if (n == 0) return result;
    std::vector<double> d(n);
    for (std::size_t i = 0; i < n; ++i) d[i] = b[i] - a[i];
    result.difference = mean(d);
    double size = 0;
    for (const double value : d) size += std::abs(value);
    const double threshold =
        std::abs(result.difference) * static_cast<double>(n) - kRounding * size;
    Numbers numbers(options.seed);
    result.exact = n <= kExactPairs;
    result.p_permutation = result.exact ? exact_flips(d, threshold)
                                        : random_flips(d, threshold, options.permutations, numbers);
    if (n == 1) {  // no deviation is known
        result.p_parametric = result.effect = NAN;
        result.low = result.high = result.bca_low = result.bca_high = NAN;
        return result;
    }
    const double deviation = std::sqrt(squares(d) / static_cast<double>(n - 1));
    if (deviation > kRounding * size / static_cast<double>(n)) {
        result.effect = result.difference / deviation;
        result.p_parametric = student_two_sided(result.effect * std::sqrt(static_cast<double>(n)),
                                                static_cast<double>(n - 1));
    } else if (result.difference != 0) {  // all differences are equal
        result.effect = std::copysign(INFINITY, result.difference);
        result.p_parametric = 0;
    }
    find_intervals(
        options.bootstraps, acceleration(cubes(d), squares(d)),
        kRounding * size / static_cast<double>(n), [&] { return resampled_mean(d, numbers); },
        result);
    return result;
}

Comparison compare_pooled(std::span<const double> a, std::span<const double> b,
                          const ResampleOptions& options) {
    Comparison result;
    if (a.empty() || b.empty()) return result;
    result.difference = mean(b) - mean(a);
    Numbers numbers(options.seed);
    std::vector<double> all(a.begin(), a.end());
    all.insert(all.end(), b.begin(), b.end());
    const double total = std::accumulate(all.begin(), all.end(), 0.0);
    const auto na = static_cast<double>(a.size());
    const auto nb = static_cast<double>(b.size());
    const double tolerance = kRounding * std::abs(total / (na + nb));
    std::uint64_t above = 1, below = 1;  // the observed order is one of the draws, as in pairs
    for (std::uint32_t k = 0; k < options.permutations; ++k) {
        double sum = 0;  // sum of the first b.size() of a shuffle, the other ones are a's
        for (std::size_t i = 0; i < b.size(); ++i) {
            std::swap(all[i], all[i + numbers.below(all.size() - i)]);
            sum += all[i];
        }
        const double difference = sum / nb - (total - sum) / na;
        if (difference >= result.difference - tolerance) ++above;
        if (difference <= result.difference + tolerance) ++below;
    }
    result.p_permutation = std::min(
        1.0, 2 * static_cast<double>(std::min(above, below)) / (1.0 + options.permutations));
    const double deviation = std::sqrt(squares(a) / na);
    if (deviation == 0 && result.difference != 0) result.p_parametric = 0;
    if (deviation > 0)
        result.p_parametric =
            std::erfc(std::abs(result.difference) / (deviation / std::sqrt(na)) / std::sqrt(2.0));
    if (na + nb > 2) {
        const double pooled = std::sqrt((squares(a) + squares(b)) / (na + nb - 2));
        if (pooled > 0)
            result.effect = result.difference / pooled;
        else if (result.difference != 0)
            result.effect = std::copysign(INFINITY, result.difference);
    }
    find_intervals(
        options.bootstraps,
        acceleration(cubes(b) / std::pow(nb, 3) - cubes(a) / std::pow(na, 3),
                     squares(b) / (nb * nb) + squares(a) / (na * na)),
        tolerance,
        [&] {
            const double second = resampled_mean(b, numbers);
            return second - resampled_mean(a, numbers);
        },
        result);
    return result;
}

bool too_few(std::size_t n_a, std::size_t n_b, std::size_t tests, double level, bool unpaired) {
    double least = 2;
    if (unpaired)
        for (std::size_t i = 1; i <= n_a; ++i)
            least *= static_cast<double>(i) / static_cast<double>(n_b + i);
    else
        least = std::exp2(1 - static_cast<double>(n_a));
    return !(static_cast<double>(tests) * least < level);
}

std::size_t least_objects(std::size_t tests, double level, bool unpaired) {
    std::size_t n = 1;
    while (too_few(n, n, tests, level, unpaired)) ++n;
    return n;
}

std::vector<double> holm(std::span<const double> p) {
    std::vector<std::size_t> order(p.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, [&p](std::size_t i, std::size_t j) { return p[i] < p[j]; });
    std::vector<double> adjusted(p.size());
    double most = 0;
    for (std::size_t i = 0; i < order.size(); ++i) {
        most = std::max(most, std::min(1.0, static_cast<double>(p.size() - i) * p[order[i]]));
        adjusted[order[i]] = most;
    }
    return adjusted;
}

}  // namespace splat::eval
