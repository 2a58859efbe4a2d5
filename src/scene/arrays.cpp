#include "scene/arrays.h"

#include <algorithm>
#include <cmath>

namespace splat::scene {

std::array<Attribute, 5> attributes(std::uint32_t sh_degree) {
    return {{{"means", &Gaussians::means, 3},
             {"log_scales", &Gaussians::log_scales, 3},
             {"rotations", &Gaussians::rotations, 4},
             {"opacity_logits", &Gaussians::opacity_logits, 1},
             {"sh", &Gaussians::sh, 3 * std::size_t{sh_coefficients(sh_degree)}}}};
}

std::vector<std::string> drawn_as_names(const DrawnAs& drawn_as) {
    std::vector<std::string> names;
    if (drawn_as.antialiased) names.emplace_back("antialiased");
    if (drawn_as.by_distance) names.emplace_back("by distance");
    if (drawn_as.three_sigma) names.emplace_back("3 sigma");
    if (drawn_as.linear_colors) names.emplace_back("linear colours");
    return names;
}

Quaternion rotation_at(const Gaussians& g, std::size_t i) {
    const float* const q = &g.rotations[4 * i];
    return glm::quat(q[0], q[1], q[2], q[3]);
}

Status check_arrays(const Gaussians& g) {
    if (g.sh_degree > kMaxShDegree)
        return invalid("gaussians: SH degree %u, expected 0 to %u", g.sh_degree, kMaxShDegree);
    for (const Attribute& attribute : attributes(g.sh_degree)) {
        const std::size_t got = (g.*attribute.array).size();
        if (got % attribute.each != 0 || got / attribute.each != g.count())
            return invalid("gaussians: '%s' holds %zu values, expected %zu x %zu", attribute.name,
                           got, g.count(), attribute.each);
    }
    return {};
}

Gaussians make_gaussians(std::size_t count, std::uint32_t sh_degree) {
    Gaussians g;
    g.sh_degree = sh_degree;
    resize(g, count);
    return g;
}

void resize(Gaussians& g, std::size_t count) {
    for (const auto& [name, array, each] : attributes(g.sh_degree)) (g.*array).resize(count * each);
}

Gaussians reserve_gaussians(std::size_t count, std::uint32_t sh_degree) {
    Gaussians g;
    g.sh_degree = sh_degree;
    for (const auto& [name, array, each] : attributes(sh_degree)) (g.*array).reserve(count * each);
    return g;
}

Gaussians part(const Gaussians& from, std::size_t first, std::size_t count) {
    SPLAT_ASSERT(first <= from.count() && count <= from.count() - first);
    Gaussians to;
    to.sh_degree = from.sh_degree;
    to.drawn_as = from.drawn_as;
    for (const auto& [name, array, each] : attributes(from.sh_degree)) {
        const float* const at = (from.*array).data() + first * each;
        (to.*array).assign(at, at + count * each);
    }
    return to;
}

Gaussians gather(const Gaussians& from, const std::vector<std::size_t>& indices) {
    Gaussians to = make_gaussians(indices.size(), from.sh_degree);
    to.drawn_as = from.drawn_as;
    for (const auto& [name, array, each] : attributes(from.sh_degree)) {
        float* place = (to.*array).data();
        for (const std::size_t index : indices) {
            SPLAT_ASSERT(index < from.count());
            place = std::copy_n((from.*array).data() + index * each, each, place);
        }
    }
    return to;
}

void set_sh_degree(Gaussians& g, std::uint32_t sh_degree) {
    if (sh_degree == g.sh_degree) return;
    const std::size_t old_each = sh_coefficients(g.sh_degree) * 3;
    const std::size_t new_each = sh_coefficients(sh_degree) * 3;
    std::vector<float> sh(g.count() * new_each);
    for (std::size_t i = 0; i < g.count(); ++i)
        std::copy_n(&g.sh[i * old_each], std::min(old_each, new_each), &sh[i * new_each]);
    g.sh = std::move(sh);
    g.sh_degree = sh_degree;
}

Gaussians with_sh_degree(Gaussians g, std::uint32_t sh_degree) {
    set_sh_degree(g, sh_degree);
    return g;
}

std::size_t normalise_rotations(Gaussians& g) {
    constexpr double kUnit = 1e-6;
    std::size_t kept = 0;
    for (std::size_t i = 0; 4 * i < g.rotations.size(); ++i) {
        const Quaternion rotation = rotation_at(g, i);
        const double length = length_of(rotation);
        if (!std::isfinite(length) || length == 0) {
            ++kept;
        } else if (std::abs(length - 1) > kUnit) {
            const glm::quat unit = rotation / length;
            std::copy_n(&unit.w, 4, &g.rotations[4 * i]);
        }
    }
    return kept;
}

}  // namespace splat::scene
