#include "scene/arrays.h"

#include <algorithm>
#include <cmath>

namespace splat::scene {
namespace {

Status check_length(const char* name, std::size_t got, std::size_t count, std::size_t each) {
    if (got % each == 0 && got / each == count) return {};
    return error(Code::kInvalidArgument, "gaussians: '%s' holds %zu values, expected %zu x %zu",
                 name, got, count, each);
}

void copy_values(const std::vector<float>& from, std::size_t index, std::size_t each,
                 std::vector<float>& to, std::size_t place) {
    std::copy_n(from.begin() + static_cast<std::ptrdiff_t>(index * each), each,
                to.begin() + static_cast<std::ptrdiff_t>(place * each));
}

}  // namespace

Status check_arrays(const Gaussians& g) {
    if (g.sh_degree > kMaxShDegree)
        return error(Code::kInvalidArgument, "gaussians: SH degree %u, expected 0 to %u",
                     g.sh_degree, kMaxShDegree);
    const std::size_t count = g.count();
    SPLAT_TRY(check_length("means", g.means.size(), count, 3));
    SPLAT_TRY(check_length("log_scales", g.log_scales.size(), count, 3));
    SPLAT_TRY(check_length("rotations", g.rotations.size(), count, 4));
    return check_length("sh", g.sh.size(), count, sh_coefficients(g.sh_degree) * 3);
}

Gaussians make_gaussians(std::size_t count, std::uint32_t sh_degree) {
    Gaussians g;
    g.sh_degree = sh_degree;
    g.means.resize(count * 3);
    g.log_scales.resize(count * 3);
    g.rotations.resize(count * 4);
    g.opacity_logits.resize(count);
    g.sh.resize(count * sh_coefficients(sh_degree) * 3);
    return g;
}

Gaussians gather(const Gaussians& from, const std::vector<std::size_t>& indices) {
    Gaussians to = make_gaussians(indices.size(), from.sh_degree);
    const std::size_t each = sh_coefficients(from.sh_degree) * 3;
    for (std::size_t place = 0; place < indices.size(); ++place) {
        const std::size_t index = indices[place];
        SPLAT_ASSERT(index < from.count());
        copy_values(from.means, index, 3, to.means, place);
        copy_values(from.log_scales, index, 3, to.log_scales, place);
        copy_values(from.rotations, index, 4, to.rotations, place);
        copy_values(from.opacity_logits, index, 1, to.opacity_logits, place);
        copy_values(from.sh, index, each, to.sh, place);
    }
    return to;
}

Gaussians with_sh_degree(const Gaussians& from, std::uint32_t sh_degree) {
    Gaussians to = from;
    if (sh_degree == from.sh_degree) return to;
    const std::size_t old_each = sh_coefficients(from.sh_degree) * 3;
    const std::size_t new_each = sh_coefficients(sh_degree) * 3;
    to.sh_degree = sh_degree;
    to.sh.assign(from.count() * new_each, 0.0F);
    for (std::size_t i = 0; i < from.count(); ++i)
        for (std::size_t k = 0; k < std::min(old_each, new_each); ++k)
            to.sh[i * new_each + k] = from.sh[i * old_each + k];
    return to;
}

std::size_t normalise_rotations(Gaussians& g) {
    constexpr double kUnit = 1e-6;
    std::size_t kept = 0;
    for (std::size_t i = 0; i + 3 < g.rotations.size(); i += 4) {
        double squared = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            const auto value = static_cast<double>(g.rotations[i + k]);
            squared += value * value;
        }
        const double length = std::sqrt(squared);
        if (!std::isfinite(length) || length == 0) {
            ++kept;
        } else if (std::abs(length - 1) > kUnit) {
            for (std::size_t k = 0; k < 4; ++k)
                g.rotations[i + k] =
                    static_cast<float>(static_cast<double>(g.rotations[i + k]) / length);
        }
    }
    return kept;
}

}  // namespace splat::scene
