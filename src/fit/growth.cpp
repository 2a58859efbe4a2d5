#include "fit/growth.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/rng.h"
#include "params/fit_params.h"

namespace splat::fit {
namespace {

constexpr std::uint32_t kMostShares = 51;
constexpr std::uint32_t kRelocation =
    1;  ///< the last word of the counter tells uses of the seed apart

}  // namespace

// The sum over i of C(i - 1, k) in the paper's double sum is C(copies, k + 1).
Share share_of(double opacity, std::uint32_t copies) {
    const double all = std::min(opacity, 1 - 1e-7);
    const double one = 1 - std::pow(1 - all, 1.0 / copies);
    double sum = 0, term = -1;
    for (std::uint32_t k = 1; k <= copies; ++k) {
        term *= -one * (copies - k + 1) / k;
        sum += term / std::sqrt(k);
    }
    return {one, all / sum};
}

std::vector<Row> relocated_rows(std::span<const Score> scores, std::uint32_t wanted,
                                std::uint64_t seed, std::uint64_t step) {
    const auto low = [](std::uint64_t word) { return static_cast<std::uint32_t>(word); };
    std::vector<std::uint32_t> live, shares(scores.size(), 1);
    std::vector<double> sums;
    std::vector<Row> rows(std::max<std::size_t>(scores.size(), wanted));
    for (std::uint32_t i = 0; i < scores.size(); ++i) {
        rows[i].source = i;
        if (!(scores[i].opacity > kFaint)) continue;
        live.push_back(i);
        sums.push_back((sums.empty() ? 0 : sums.back()) + static_cast<double>(scores[i].opacity));
    }
    if (live.empty()) {
        rows.resize(scores.size());
        return rows;
    }
    std::uint32_t draws = 0;
    for (std::size_t i = 0; i < rows.size(); ++i) {
        if (i < scores.size() && scores[i].opacity > kFaint) continue;
        const auto word = philox({draws++, low(step), low(step >> 32), kRelocation},
                                 {low(seed), low(seed >> 32)});
        const double at = (word[0] * 0x1p-32 + word[1] * 0x1p-64) * sums.back();
        const auto found = std::upper_bound(sums.begin(), sums.end() - 1, at) - sums.begin();
        rows[i].source = live[static_cast<std::size_t>(found)];
        ++shares[rows[i].source];
    }
    for (Row& row : rows) {
        const std::uint32_t copies = std::min(shares[row.source], kMostShares);
        if (copies == 1) continue;
        const Share share = share_of(static_cast<double>(scores[row.source].opacity), copies);
        const double opacity = std::max(share.opacity, static_cast<double>(kFaint));
        row = {row.source, params::kFitShare, static_cast<float>(std::log(opacity / (1 - opacity))),
               static_cast<float>(std::log(share.scale))};
    }
    return rows;
}

std::vector<Row> grown_rows(std::span<const Score> scores, std::uint32_t wanted) {
    std::vector<std::uint32_t> kept;
    for (std::uint32_t i = 0; i < scores.size(); ++i)
        if (scores[i].opacity >= kFaint) kept.push_back(i);
    if (kept.empty()) kept.push_back(0);
    const std::size_t room = wanted > kept.size() ? wanted - kept.size() : 0;
    std::vector<std::uint32_t> chosen = kept;
    std::erase_if(chosen, [&](std::uint32_t i) { return !(scores[i].gradient > 0); });
    const std::size_t most = std::min({room, kept.size() / 2, chosen.size()});
    const auto end = chosen.begin() + static_cast<std::ptrdiff_t>(most);
    std::nth_element(chosen.begin(), end, chosen.end(), [&](std::uint32_t a, std::uint32_t b) {
        return scores[a].gradient != scores[b].gradient ? scores[a].gradient > scores[b].gradient
                                                        : a < b;
    });
    chosen.erase(end, chosen.end());
    std::sort(chosen.begin(), chosen.end());
    std::vector<Row> rows;
    for (const std::uint32_t i : kept) {
        const bool split = std::binary_search(chosen.begin(), chosen.end(), i);
        rows.push_back({i, split ? params::kFitSecondHalf : params::kFitKeep});
    }
    for (const std::uint32_t i : chosen) rows.push_back({i, params::kFitFirstHalf});
    return rows;
}

}  // namespace splat::fit
