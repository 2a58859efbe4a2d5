#include "fit/growth.h"

#include <algorithm>
#include <numeric>

#include "params/fit_params.h"

namespace splat::fit {

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
