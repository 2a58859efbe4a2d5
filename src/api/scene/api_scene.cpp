#include <algorithm>
#include <shared_mutex>

#include "api/api_guard.h"
#include "api/handles.h"
#include "api/scene/drawn_as.h"
#include "api/scene/scene_attribute.h"
#include "gaussians/gaussian_set.h"
#include "io/scene_formats.h"
#include "scene/arrays.h"
#include "scene/select.h"
#include "scene/statistics.h"
#include "scene/transform.h"

using namespace splat;

namespace {

constexpr std::uint64_t kMaxCount = std::uint64_t{1} << 27;

Status check_count(std::uint64_t count) {
    if (count <= kMaxCount) return {};
    return unsupported("a scene of %llu Gaussians, expected at most %llu", llu(count),
                       llu(kMaxCount));
}

Result<scene::Gaussians> gaussians_of(const splat_scene_desc& desc) {
    if (desc.sh_degree > scene::kMaxShDegree)
        return invalid("splat_scene_desc.sh_degree is %u, expected 0 to %u", desc.sh_degree,
                       scene::kMaxShDegree);
    SPLAT_TRY(api::check_flags(desc.drawn_as, api::kDrawnBits, "splat_scene_desc.drawn_as"));
    SPLAT_TRY(check_count(desc.count));
    const auto count = static_cast<std::size_t>(desc.count);
    scene::Gaussians gaussians = scene::make_gaussians(count, desc.sh_degree);
    gaussians.drawn_as = api::drawn_as_of(desc.drawn_as);
    const auto fill = [](const char* name, const float* from, std::uint64_t length,
                         std::vector<float>& to) -> Status {
        if (from == nullptr && length != 0)
            return invalid("splat_scene_desc.%s is NULL, but its length is %llu", name,
                           llu(length));
        if (from == nullptr) return {};
        if (length != 0 && length < to.size())
            return invalid("splat_scene_desc.%s has %llu floats, its Gaussians take %zu", name,
                           llu(length), to.size());
        std::copy_n(from, to.size(), to.begin());
        return {};
    };
    SPLAT_TRY(fill("means", desc.means, desc.mean_count, gaussians.means));
    SPLAT_TRY(fill("log_scales", desc.log_scales, desc.log_scale_count, gaussians.log_scales));
    SPLAT_TRY(fill("rotations", desc.rotations, desc.rotation_count, gaussians.rotations));
    SPLAT_TRY(fill("opacity_logits", desc.opacity_logits, desc.opacity_logit_count,
                   gaussians.opacity_logits));
    SPLAT_TRY(fill("sh", desc.sh, desc.sh_count, gaussians.sh));
    for (std::size_t i = 0; desc.rotations == nullptr && i < count; ++i)
        gaussians.rotations[4 * i] = 1;
    return gaussians;
}

std::shared_ptr<api::SceneObject> scene_of(scene::Gaussians gaussians) {
    auto object = std::make_shared<api::SceneObject>();
    object->gaussians = std::move(gaussians);
    return object;
}

/// Replace the Gaussians of a scene by the result of `make`. On failure the scene stays as it was.
template <class Make>
splat_result replace(splat_scene scene, Make&& make) {
    return api::with(scene, [&](const auto& object) -> Status {
        const std::lock_guard lock(object->mutex);
        SPLAT_ASSIGN(object->gaussians, make(std::as_const(object->gaussians)));
        object->copies.clear();
        return {};
    });
}

Status check_bytes(const char* name, std::size_t elements, std::size_t bytes) {
    if (bytes >= elements * sizeof(float)) return {};
    return invalid("bytes is %zu, but '%s' takes %zu", bytes, name, elements * sizeof(float));
}

/// The attribute that a call names. Errors: NULL arguments, an unknown name, too few bytes.
Result<const api::SceneAttribute*> attribute_of(const api::SceneObject& object, const char* name,
                                                const float* values, std::size_t bytes) {
    SPLAT_TRY(api::require(name, "name"));
    SPLAT_ASSIGN(const api::SceneAttribute* attribute, api::find_attribute(name));
    const std::size_t elements = (object.gaussians.*attribute->array).size();
    if (elements > 0 || bytes > 0) SPLAT_TRY(api::require(values, "values"));
    SPLAT_TRY(check_bytes(name, elements, bytes));
    return attribute;
}

splat_scene_info info_of(const scene::Statistics& s) {
    splat_scene_info info{};
    info.sh_degree = s.sh_degree;
    info.count = s.count;
    std::copy_n(glm::value_ptr(s.bounds.low), 3, info.low);
    std::copy_n(glm::value_ptr(s.bounds.high), 3, info.high);
    std::copy_n(glm::value_ptr(s.center), 3, info.center);
    SPLAT_COPY(info, s, radius, non_finite, bad_rotations, degenerate, invisible);
    info.scale_min = s.scales.min;
    info.scale_max = s.scales.max;
    info.scale_mean = s.scales.mean;
    info.opacity_min = s.opacities.min;
    info.opacity_max = s.opacities.max;
    info.opacity_mean = s.opacities.mean;
    SPLAT_COPY(info, s, bytes, fill_ratio);
    info.band_max = s.bands.magnitude();
    info.device_bytes =
        gaussians::SetDesc{static_cast<std::uint32_t>(s.count), s.sh_degree}.bytes();
    return info;
}

/// Copies of the Gaussians of live scenes. Each scene is locked while it is copied.
Result<std::vector<scene::Gaussians>> copies_of(const splat_scene* scenes, std::uint32_t count) {
    std::vector<scene::Gaussians> copies;
    std::uint64_t total = 0;
    for (std::uint32_t i = 0; i < count; ++i) {
        SPLAT_ASSIGN(const auto object,
                     api::Scenes::find(scenes[i], format("scenes[%u]", i).c_str()));
        const std::shared_lock lock(object->mutex);
        total += object->gaussians.count();
        SPLAT_TRY(check_count(total));
        copies.push_back(object->gaussians);
    }
    return copies;
}

}  // namespace

splat_result splat_scene_create(const splat_scene_desc* desc, splat_scene* scene) {
    return api::create(scene, [&]() -> api::Scenes::Made {
        SPLAT_TRY(api::check_desc(desc, 0));
        SPLAT_ASSIGN(scene::Gaussians gaussians, gaussians_of(*desc));
        return scene_of(std::move(gaussians));
    });
}

splat_result splat_scene_load_report(splat_scene scene, char* buffer, size_t capacity,
                                     size_t* needed) {
    return api::report(scene, buffer, capacity, needed, [](auto& object) { return object.report; });
}

splat_result splat_scene_read(splat_scene scene, const char* name, float* values, size_t bytes) {
    return api::with(scene, [&](const auto& object) -> Status {
        const std::shared_lock lock(object->mutex);
        SPLAT_ASSIGN(const api::SceneAttribute* attribute,
                     attribute_of(*object, name, values, bytes));
        const std::vector<float> read = api::attribute_values(*attribute, object->gaussians);
        std::ranges::copy(read, values);
        return {};
    });
}

splat_result splat_scene_write(splat_scene scene, const char* name, const float* values,
                               size_t bytes) {
    return api::with(scene, [&](const auto& object) -> Status {
        const std::lock_guard lock(object->mutex);
        SPLAT_ASSIGN(const api::SceneAttribute* attribute,
                     attribute_of(*object, name, values, bytes));
        const std::size_t elements = (object->gaussians.*attribute->array).size();
        SPLAT_TRY(api::set_attribute(*attribute, {values, elements}, object->gaussians));
        object->copies.clear();
        return {};
    });
}

splat_result splat_scene_to_tensor(splat_scene scene, const char* name, splat_device device,
                                   splat_tensor* tensor) {
    splat_tensor_desc desc{};
    desc.struct_size = sizeof desc;
    desc.name = name;
    std::vector<float> values;
    const auto read = [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(name, "name"));
        SPLAT_ASSIGN(const api::SceneAttribute* attribute, api::find_attribute(name));
        const std::shared_lock lock(object->mutex);
        SPLAT_ASSIGN(const Shape shape, api::attribute_shape(*attribute, object->gaussians));
        desc.rank = shape.rank();
        for (std::uint32_t axis = 0; axis < desc.rank; ++axis) desc.dims[axis] = shape[axis];
        values = api::attribute_values(*attribute, object->gaussians);
        return {};
    };
    const splat_result result = api::with(scene, read);
    if (result != SPLAT_OK) return result;
    return splat_tensor_from_host(device, &desc, values.data(), values.size() * sizeof(float),
                                  nullptr, tensor);
}

splat_result splat_scene_transform(splat_scene scene, const splat_similarity* similarity) {
    return replace(scene, [&](const scene::Gaussians& from) -> Result<scene::Gaussians> {
        SPLAT_TRY(api::require(similarity, "similarity"));
        scene::Similarity s;
        const double* const q = similarity->rotation;
        s.rotation = {q[0], q[1], q[2], q[3]};
        s.translation = glm::make_vec3(similarity->translation);
        s.scale = similarity->scale;
        scene::Gaussians moved = from;
        SPLAT_TRY(scene::transform(moved, s));
        return moved;
    });
}

splat_result splat_scene_crop(splat_scene scene, const double* low, const double* high) {
    return replace(scene, [&](const scene::Gaussians& from) -> Result<scene::Gaussians> {
        SPLAT_TRY(api::require(low, "low", high, "high"));
        return scene::crop(from, {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}});
    });
}

splat_result splat_scene_crop_sphere(splat_scene scene, const double* center, double radius) {
    return replace(scene, [&](const scene::Gaussians& from) -> Result<scene::Gaussians> {
        SPLAT_TRY(api::require(center, "center"));
        return scene::crop_sphere(from, glm::make_vec3(center), radius);
    });
}

splat_result splat_scene_filter(splat_scene scene, uint32_t flags, double min_opacity) {
    return replace(scene, [&](const scene::Gaussians& from) -> Result<scene::Gaussians> {
        SPLAT_TRY(api::check_flags(flags, SPLAT_FILTER_FINITE | SPLAT_FILTER_SORT));
        if (!(min_opacity >= 0 && min_opacity <= 1))
            return invalid("min_opacity is %g, expected 0 to 1", min_opacity);
        scene::Gaussians kept = from;
        if ((flags & SPLAT_FILTER_FINITE) != 0) SPLAT_SET(kept, scene::remove_invalid(kept));
        if (min_opacity > 0) SPLAT_SET(kept, scene::filter_by_opacity(kept, min_opacity));
        if ((flags & SPLAT_FILTER_SORT) != 0) SPLAT_SET(kept, scene::sort_morton(kept));
        return kept;
    });
}

splat_result splat_scene_set_sh_degree(splat_scene scene, uint32_t sh_degree) {
    return api::with(scene, [&](const auto& object) -> Status {
        if (sh_degree > scene::kMaxShDegree)
            return invalid("sh_degree is %u, expected 0 to %u", sh_degree, scene::kMaxShDegree);
        const std::lock_guard lock(object->mutex);
        scene::set_sh_degree(object->gaussians, sh_degree);
        object->copies.clear();
        return {};
    });
}

splat_result splat_scene_merge(const splat_scene* scenes, uint32_t count, splat_scene* scene) {
    return api::create(scene, [&]() -> api::Scenes::Made {
        if (count > 0) SPLAT_TRY(api::require(scenes, "scenes"));
        SPLAT_ASSIGN(const std::vector<scene::Gaussians> copies, copies_of(scenes, count));
        SPLAT_ASSIGN(scene::Gaussians merged, scene::merge(copies));
        return scene_of(std::move(merged));
    });
}

splat_result splat_scene_get_size(splat_scene scene, uint64_t* count, uint32_t* sh_degree) {
    return api::with(scene, [&](const auto& object) -> Status {
        const std::shared_lock lock(object->mutex);
        if (count != nullptr) *count = object->gaussians.count();
        if (sh_degree != nullptr) *sh_degree = object->gaussians.sh_degree;
        return {};
    });
}

splat_result splat_scene_get_info(splat_scene scene, splat_scene_info* info) {
    return api::describe(scene, info, "info", [&](auto& object) -> Result<splat_scene_info> {
        const std::shared_lock lock(object.mutex);
        SPLAT_ASSIGN(const scene::Statistics measured, scene::statistics(object.gaussians));
        splat_scene_info filled = info_of(measured);
        filled.beyond_spz = io::scales_beyond_spz(object.gaussians);
        filled.drawn_as = api::drawn_bits(object.gaussians.drawn_as);
        return filled;
    });
}
