#include "scene/lens.h"

#include <algorithm>

#include "core/status.h"

namespace splat::scene {
namespace {

struct Parameter {
    const char* name;
    double* value;
};

/// The parameters and their names; without one where no model of the kind has it.
std::array<Parameter, 12> parameters_of(Lens& lens) {
    const bool rational = lens.kind == LensKind::kPerspective;
    return {{{"k1", &lens.radial[0]},
             {"k2", &lens.radial[1]},
             {"k3", &lens.radial[2]},
             {rational ? "k4 (r^8)" : "k4", &lens.radial[3]},
             {rational ? "k4" : "", &lens.denominator[0]},
             {rational ? "k5" : "", &lens.denominator[1]},
             {rational ? "k6" : "", &lens.denominator[2]},
             {"p1", &lens.tangential[0]},
             {"p2", &lens.tangential[1]},
             {"sx1", &lens.prism[0]},
             {"sy1", &lens.prism[1]},
             {"omega", &lens.omega}}};
}

/// The factor by which the kind moves a ray.
double kind_factor(const Lens& lens, const Vec2& place) {
    constexpr double kSmall = 1e-9;  // an angle whose square vanishes beside 1
    if (lens.kind == LensKind::kPerspective) return 1;
    const double r = std::sqrt(place.x * place.x + place.y * place.y);
    if (lens.kind == LensKind::kFisheye) return r < kSmall ? 1 : std::atan(r) / r;
    if (std::abs(lens.omega) < kSmall) return 1;
    const double slope = 2 * std::tan(lens.omega / 2);
    return (r < kSmall ? slope : std::atan(r * slope) / r) / lens.omega;
}

}  // namespace

bool is_pinhole(const Lens& lens) {
    Lens copy = lens;
    return lens.kind != LensKind::kFisheye &&
           std::ranges::all_of(parameters_of(copy),
                               [](const Parameter& parameter) { return *parameter.value == 0; });
}

bool set_parameter(Lens& lens, std::string_view name, double value) {
    if (name == "k") name = "k1";
    for (const Parameter& parameter : parameters_of(lens))
        if (parameter.name == name) {
            *parameter.value = value;
            return true;
        }
    return false;
}

std::string lens_text(const Lens& lens) {
    constexpr const char* kNames[] = {"perspective", "fisheye", "FOV"};
    std::string text = kNames[static_cast<int>(lens.kind)];
    Lens copy = lens;
    const char* comma = " ";
    for (const Parameter& parameter : parameters_of(copy))
        if (*parameter.value != 0) {
            text += format("%s%s = %.4g", comma, parameter.name, *parameter.value);
            comma = ", ";
        }
    return text;
}

Vec2 distort(const Lens& lens, const Vec2& place) {
    const Vec2 uv = place * kind_factor(lens, place);
    const auto& [k1, k2, k3, k4] = lens.radial;
    const auto& [d1, d2, d3] = lens.denominator;
    const auto& [p1, p2] = lens.tangential;
    const double s = uv.x * uv.x + uv.y * uv.y;
    const double xy = 2 * uv.x * uv.y;
    const double radial =
        (1 + s * (k1 + s * (k2 + s * (k3 + s * k4)))) / (1 + s * (d1 + s * (d2 + s * d3)));
    return {uv.x * radial + p1 * xy + p2 * (s + 2 * uv.x * uv.x) + lens.prism[0] * s,
            uv.y * radial + p2 * xy + p1 * (s + 2 * uv.y * uv.y) + lens.prism[1] * s};
}

double unfolded_radius(const Lens& lens, double most) {
    constexpr int kSteps = 1000;
    Lens even = lens;
    even.tangential = even.prism = {};
    double last = 0;
    for (int i = 1; i <= kSteps; ++i) {
        const double there = distort(even, {most * i / kSteps, 0}).x;
        if (!(there > last)) return most * (i - 1) / kSteps;
        last = there;
    }
    return most;
}

}  // namespace splat::scene
