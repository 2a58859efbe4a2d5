#include <algorithm>
#include <optional>
#include <shared_mutex>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "api/handles.h"
#include "api/scene/camera_value.h"
#include "core/log.h"
#include "scene/camera_pose.h"
#include "triangles/renderer.h"

using namespace splat;

namespace {

/// Where the maps of one view go; nothing where one is not wanted.
struct MapViews {
    std::optional<api::ImageView> color, albedo, mask, depth, normal;

    [[nodiscard]] triangles::Wanted wanted() const {
        const auto has_alpha = [](const auto& view) { return view && view->channels == 4; };
        return {.color = color.has_value(),
                .alpha = mask.has_value() || has_alpha(color) || has_alpha(albedo),
                .depth = depth.has_value(),
                .normal = normal.has_value(),
                .albedo = albedo.has_value()};
    }
};

Result<triangles::RenderDesc> render_desc_of(const splat_mesh_render_desc* desc) {
    triangles::RenderDesc made;
    made.background = {0, 0, 0};
    if (desc == nullptr) return made;
    SPLAT_TRY(api::check_desc(desc, SPLAT_MESH_UNLIT));
    made.light = (desc->flags & SPLAT_MESH_UNLIT) == 0;
    if (desc->samples != 0) made.samples = desc->samples;
    std::ranges::copy(desc->background, made.background.begin());
    if (std::ranges::any_of(desc->up, [](double value) { return value != 0; }))
        std::ranges::copy(desc->up, made.up.begin());
    made.near_plane = desc->near_plane;
    SPLAT_TRY(triangles::check_desc(made));
    return made;
}

/// One map of a view; nothing if it has no pixels.
Result<std::optional<api::ImageView>> map_view(const splat_image& image, const std::string& name,
                                               const scene::Camera& camera, std::uint32_t channels,
                                               std::uint32_t most_channels, bool numbers) {
    if (image.pixels == nullptr) return std::optional<api::ImageView>();
    SPLAT_ASSIGN(const api::ImageView view, api::image_to_fill(&image, name.c_str()));
    const std::uint32_t expected = view.channels == most_channels ? most_channels : channels;
    SPLAT_TRY(api::check_image_size(view, name.c_str(), camera.width, camera.height, expected));
    if (numbers && view.type == SPLAT_PIXEL_U8)
        return invalid("%s.type is SPLAT_PIXEL_U8, expected SPLAT_PIXEL_F16 or SPLAT_PIXEL_F32",
                       name.c_str());
    return std::optional(view);
}

Result<MapViews> map_views(const splat_mesh_maps& maps, const scene::Camera& camera,
                           const std::string& name) {
    MapViews views;
    SPLAT_SET(views.color, map_view(maps.color, name + ".color", camera, 3, 4, false));
    SPLAT_SET(views.albedo, map_view(maps.albedo, name + ".albedo", camera, 3, 4, false));
    SPLAT_SET(views.mask, map_view(maps.mask, name + ".mask", camera, 1, 1, false));
    SPLAT_SET(views.depth, map_view(maps.depth, name + ".depth", camera, 1, 1, true));
    SPLAT_SET(views.normal, map_view(maps.normal, name + ".normal", camera, 3, 3, true));
    if (!views.color && !views.albedo && !views.mask && !views.depth && !views.normal)
        return invalid("%s has no pixels, expected at least one map", name.c_str());
    return views;
}

void fill_rgb(const api::ImageView& view, const std::vector<float>& rgb,
              const std::vector<float>& alpha) {
    if (view.channels == 3) return api::fill_interleaved(view, rgb.data());
    std::vector<float> pixels;
    pixels.reserve(view.samples());
    for (std::size_t i = 0; i < alpha.size(); ++i) {
        pixels.insert(pixels.end(), &rgb[3 * i], &rgb[3 * i] + 3);
        pixels.push_back(alpha[i]);
    }
    api::fill_interleaved(view, pixels.data());
}

void fill(const MapViews& views, const triangles::Images& images) {
    if (views.color) fill_rgb(*views.color, images.color, images.alpha);
    if (views.albedo) fill_rgb(*views.albedo, images.albedo, images.alpha);
    if (views.mask) api::fill_interleaved(*views.mask, images.alpha.data());
    if (views.depth) api::fill_interleaved(*views.depth, images.depth.data());
    if (views.normal) api::fill_interleaved(*views.normal, images.normal.data());
}

/// One view of a call, checked.
struct MeshView {
    scene::Camera camera;
    MapViews maps;
};

Status draw(vk::Context& context, api::MeshObject& object, const triangles::RenderDesc& desc,
            std::span<const MeshView> views) {
    const std::shared_lock lock(object.mutex);
    SPLAT_ASSIGN(const triangles::MeshOnDevice mesh, triangles::upload(context, object.mesh));
    if (!mesh.note.empty()) log(LogLevel::kWarning, mesh.note);
    for (const MeshView& view : views) {
        SPLAT_ASSIGN(const triangles::Images images,
                     triangles::render(context, mesh, {&view.camera, 1}, desc, view.maps.wanted()));
        fill(view.maps, images);
    }
    return {};
}

}  // namespace

splat_result splat_mesh_render(splat_mesh mesh, splat_device device, const splat_camera* cameras,
                               uint32_t count, const splat_mesh_render_desc* desc,
                               const splat_mesh_maps* maps) {
    return api::with(mesh, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        SPLAT_ASSIGN(const triangles::RenderDesc render_desc, render_desc_of(desc));
        if (count == 0) return {};
        SPLAT_TRY(api::require(cameras, "cameras", maps, "maps"));
        std::vector<MeshView> views;
        for (std::uint32_t i = 0; i < count; ++i) {
            MeshView view{api::camera_of(cameras[i], format("cameras[%u]", i)), {}};
            SPLAT_TRY(scene::check_camera(view.camera));
            SPLAT_SET(view.maps, map_views(maps[i], view.camera, format("maps[%u]", i)));
            views.push_back(std::move(view));
        }
        return owner->context->mutex.call(
            [&]() -> Status { return draw(*owner->context, *object, render_desc, views); });
    });
}
