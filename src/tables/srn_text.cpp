#include "tables/srn_text.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "scene/camera_pose.h"

namespace splat::tables {
namespace {

/// All numbers of a text.
Result<std::vector<double>> numbers_of(std::string_view text) {
    std::vector<double> numbers;
    const char* at = text.data();
    const char* const end = at + text.size();
    while (true) {
        while (at != end && (*at == ' ' || *at == '\t' || *at == '\n' || *at == '\r')) ++at;
        if (at == end) return numbers;
        double value = 0;
        const auto [next, code] = std::from_chars(at, end, value);
        if (code != std::errc() || next == at)
            return damaged("no number at byte %td", at - text.data());
        numbers.push_back(value);
        at = next;
    }
}

}  // namespace

Result<Focal> focal_of(std::string_view intrinsics) {
    SPLAT_ASSIGN(const std::vector<double> n, numbers_of(intrinsics));
    if (n.size() != 10 && n.size() != 11)
        return damaged(
            "%zu numbers, expected 10 (f cx cy 0, a centre of 3, a scale, height and width) or 11 "
            "(a near plane before the scale); is the file cut?",
            n.size());
    for (std::size_t i = 0; i < n.size(); ++i)
        if (!std::isfinite(n[i]))
            return damaged("number %zu of %zu is %g, expected a finite one", i + 1, n.size(), n[i]);
    for (const double side : {n[n.size() - 2], n[n.size() - 1]})
        if (!(side >= 1 && side <= scene::kMaxImageSide) || side != std::floor(side))
            return damaged(
                "the last numbers, height and width, are %g and %g, expected whole pixels "
                "from 1 to %u",
                n[n.size() - 2], n[n.size() - 1], scene::kMaxImageSide);
    if (const Status lens = scene::check_lens(n[0], n[0], n[1], n[2]); !lens.ok())
        return damaged("%s", lens.message().c_str());
    return Focal{n.front() / n[n.size() - 1], n.front() / n[n.size() - 2]};
}

Result<scene::Mat4> pose_of(std::string_view pose) {
    SPLAT_ASSIGN(const std::vector<double> n, numbers_of(pose));
    if (n.size() != 16) return damaged("%zu numbers, expected 16", n.size());
    scene::Mat4 matrix;
    std::ranges::copy(n, matrix.begin());
    return matrix;
}

}  // namespace splat::tables
