#pragma once

#include <span>

#include "core/shape.h"
#include "scene/gaussians.h"

namespace splat::api {

/// An attribute of a scene as the C API names it.
struct SceneAttribute {
    const char* name;
    std::vector<float> scene::Gaussians::*array;  ///< where it is stored
    bool activated;                               ///< scale or opacity instead of what is stored
};

/// Errors: kInvalidArgument, listing the valid names.
Result<const SceneAttribute*> find_attribute(const char* name);

/// Shape of the attribute, such as [n,3]. Errors: kInvalidState without Gaussians.
Result<Shape> attribute_shape(const SceneAttribute& attribute, const scene::Gaussians& scene);

/// Values as the API reads them. Precision: activated in float64, rounded once.
std::vector<float> attribute_values(const SceneAttribute& attribute, const scene::Gaussians& scene);

/// Set the values. Errors: kInvalidArgument for a scale that is not > 0 or an opacity outside 0 to
/// 1; the scene then stays as it was.
Status set_attribute(const SceneAttribute& attribute, std::span<const float> values,
                     scene::Gaussians& scene);

}  // namespace splat::api
