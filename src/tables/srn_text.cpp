#include "tables/srn_text.h"

#include <algorithm>
#include <charconv>

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
            return error(Code::kFormat, "no number at byte %td", at - text.data());
        numbers.push_back(value);
        at = next;
    }
}

}  // namespace

Result<Focal> focal_of(std::string_view intrinsics) {
    SPLAT_ASSIGN(const std::vector<double> n, numbers_of(intrinsics));
    if (n.size() < 6 || !(n.front() > 0) || !(n[n.size() - 1] >= 1) || !(n[n.size() - 2] >= 1))
        return error(Code::kFormat,
                     "%zu numbers, expected a focal length first and height and width last, "
                     "all > 0",
                     n.size());
    return Focal{n.front() / n[n.size() - 1], n.front() / n[n.size() - 2]};
}

Result<scene::Mat4> pose_of(std::string_view pose) {
    SPLAT_ASSIGN(const std::vector<double> n, numbers_of(pose));
    if (n.size() != 16) return error(Code::kFormat, "%zu numbers, expected 16", n.size());
    scene::Mat4 matrix;
    std::copy(n.begin(), n.end(), matrix.begin());
    return matrix;
}

}  // namespace splat::tables
