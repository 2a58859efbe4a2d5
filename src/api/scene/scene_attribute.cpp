#include "api/scene/scene_attribute.h"

#include <cmath>
#include <string>

#include "scene/activate.h"

namespace splat::api {
namespace {

using scene::Gaussians;

constexpr SceneAttribute kAttributes[] = {
    {"means", &Gaussians::means, false},
    {"log_scales", &Gaussians::log_scales, false},
    {"scales", &Gaussians::log_scales, true},
    {"rotations", &Gaussians::rotations, false},
    {"opacity_logits", &Gaussians::opacity_logits, false},
    {"opacities", &Gaussians::opacity_logits, true},
    {"sh", &Gaussians::sh, false},
};

bool is_scale(const SceneAttribute& attribute) {
    return attribute.array == &Gaussians::log_scales;
}

}  // namespace

Result<const SceneAttribute*> find_attribute(const char* name) {
    std::string names;
    for (const SceneAttribute& attribute : kAttributes) {
        if (std::string(name) == attribute.name) return &attribute;
        names += std::string(names.empty() ? "" : ", ") + attribute.name;
    }
    return invalid("name is '%s', expected one of %s", name, names.c_str());
}

Result<Shape> attribute_shape(const SceneAttribute& attribute, const Gaussians& scene) {
    const auto count = static_cast<std::int64_t>(scene.count());
    if (count == 0)
        return bad_state("the scene has no Gaussians, so '%s' has no elements", attribute.name);
    std::vector<std::int64_t> dims = {count};
    if (attribute.array == &Gaussians::sh) dims.push_back(scene::sh_coefficients(scene.sh_degree));
    if (attribute.array == &Gaussians::rotations)
        dims.push_back(4);
    else if (attribute.array != &Gaussians::opacity_logits)
        dims.push_back(3);
    return Shape::create(dims, std::string("'") + attribute.name + "'");
}

std::vector<float> attribute_values(const SceneAttribute& attribute, const Gaussians& scene) {
    std::vector<float> values = scene.*attribute.array;
    if (!attribute.activated) return values;
    for (float& value : values) {
        const auto stored = static_cast<double>(value);
        value =
            static_cast<float>(is_scale(attribute) ? std::exp(stored) : scene::opacity_of(stored));
    }
    return values;
}

Status set_attribute(const SceneAttribute& attribute, std::span<const float> values,
                     Gaussians& scene) {
    std::vector<float> stored(values.begin(), values.end());
    for (std::size_t i = 0; attribute.activated && i < stored.size(); ++i) {
        const auto value = static_cast<double>(stored[i]);
        const bool good = is_scale(attribute) ? value > 0 : value >= 0 && value <= 1;
        if (!good)
            return invalid("values[%zu] of '%s' is %g, expected %s", i, attribute.name, value,
                           is_scale(attribute) ? "> 0" : "0 to 1");
        stored[i] =
            static_cast<float>(is_scale(attribute) ? std::log(value) : scene::logit_of(value));
    }
    scene.*attribute.array = std::move(stored);
    return {};
}

}  // namespace splat::api
