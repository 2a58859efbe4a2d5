#include <shared_mutex>

#include "api/api_guard.h"
#include "api/handles.h"
#include "core/log.h"
#include "mesh_views/object_writer.h"
#include "triangles/renderer.h"

using namespace splat;
using mesh_views::ViewsDesc;

namespace {

constexpr std::uint32_t kViewMaps = SPLAT_MESH_VIEWS_DEPTH | SPLAT_MESH_VIEWS_NORMAL |
                                    SPLAT_MESH_VIEWS_MASK | SPLAT_MESH_VIEWS_ALBEDO;

static_assert(SPLAT_MESH_PROTOCOL_ORBIT == static_cast<int>(mesh_views::Protocol::kOrbit));
static_assert(SPLAT_MESH_BACKGROUND_GRADIENT ==
              static_cast<int>(mesh_views::Background::kGradient));

Result<mesh_views::Layout> view_layout_of(const char* name) {
    const std::string text = name != nullptr ? name : "srn";
    if (text == "srn") return mesh_views::Layout::kSrn;
    if (text == "images") return mesh_views::Layout::kImages;
    return invalid("desc.layout is '%s', expected srn or images", text.c_str());
}

/// The enumerator of a number. Errors: kInvalidArgument above `last`.
template <class Enum>
Result<Enum> enum_of(const char* field, std::int32_t value, Enum last) {
    if (value >= 0 && value <= static_cast<std::int32_t>(last)) return static_cast<Enum>(value);
    return invalid("desc.%s is %d, expected 0 to %d", field, value,
                   static_cast<std::int32_t>(last));
}

Result<ViewsDesc> views_desc_of(const splat_mesh_views_desc* desc) {
    SPLAT_TRY(api::check_desc(desc, kViewMaps | SPLAT_MESH_VIEWS_Y_UP));
    SPLAT_TRY(api::require(desc->path, "desc.path", desc->name, "desc.name"));
    ViewsDesc value;
    value.path = desc->path;
    value.name = desc->name;
    SPLAT_ASSIGN(value.layout, view_layout_of(desc->layout));
    if (desc->category != nullptr) value.category = desc->category;
    if (desc->split != nullptr) value.split = desc->split;
    if (desc->prepared != nullptr) value.prepared = desc->prepared;
    SPLAT_COPY(value, *desc, seed, points, fov_x, elevation, jitter, exposure);
    for (const auto& [to, from] : {std::pair(&value.size, desc->size),
                                   {&value.train_views, desc->train_views},
                                   {&value.test_views, desc->test_views},
                                   {&value.samples, desc->samples}})
        if (from != 0) *to = from;
    if (desc->distance != 0) value.distance = desc->distance;
    value.depth = (desc->flags & SPLAT_MESH_VIEWS_DEPTH) != 0;
    value.normal = (desc->flags & SPLAT_MESH_VIEWS_NORMAL) != 0;
    value.mask = (desc->flags & SPLAT_MESH_VIEWS_MASK) != 0;
    value.albedo = (desc->flags & SPLAT_MESH_VIEWS_ALBEDO) != 0;
    value.up = (desc->flags & SPLAT_MESH_VIEWS_Y_UP) != 0 ? mesh_views::Up::kY : mesh_views::Up::kZ;
    SPLAT_ASSIGN(value.protocol, enum_of("protocol", desc->protocol, mesh_views::Protocol::kOrbit));
    SPLAT_ASSIGN(value.background,
                 enum_of("background", desc->background, mesh_views::Background::kGradient));
    return value;
}

std::vector<mesh_views::Drawn> views_of(const triangles::Images& images) {
    std::vector<mesh_views::Drawn> views(images.views);
    const auto part = [&images](const std::vector<float>& all, std::size_t view) {
        const std::size_t each = all.size() / images.views;
        const auto begin = all.begin() + static_cast<std::ptrdiff_t>(view * each);
        return std::vector<float>(begin, begin + static_cast<std::ptrdiff_t>(each));
    };
    for (std::size_t i = 0; i < views.size(); ++i)
        views[i] = {part(images.color, i), part(images.alpha, i), part(images.depth, i),
                    part(images.normal, i), part(images.albedo, i)};
    return views;
}

/// Takes a mesh to the device, and draws it there. The context's mutex is held.
Result<mesh_views::Draw> drawer_of(vk::Context& context, const scene::TriangleMesh& mesh,
                                   const ViewsDesc& desc) {
    SPLAT_ASSIGN(triangles::MeshOnDevice uploaded, triangles::upload(context, mesh));
    if (!uploaded.note.empty())
        log(LogLevel::kWarning, format("'%s': %s", desc.name.c_str(), uploaded.note.c_str()));
    triangles::RenderDesc render{.samples = desc.samples, .background = {0, 0, 0}};
    if (desc.up == mesh_views::Up::kY) render.up = {0, 1, 0};
    const triangles::Wanted wanted{
        .depth = desc.depth, .normal = desc.normal, .albedo = desc.albedo};
    const auto on_device = std::make_shared<triangles::MeshOnDevice>(std::move(uploaded));
    return mesh_views::Draw([&context, on_device, render,
                             wanted](auto cameras) -> Result<std::vector<mesh_views::Drawn>> {
        SPLAT_ASSIGN(const triangles::Images images,
                     triangles::render(context, *on_device, cameras, render, wanted));
        return views_of(images);
    });
}

}  // namespace

splat_result splat_mesh_find_views(const splat_mesh_views_desc* desc, int32_t* found) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const ViewsDesc value, views_desc_of(desc));
        SPLAT_TRY(api::require(found, "found"));
        SPLAT_ASSIGN(const bool is_there, mesh_views::has_object(value));
        *found = is_there ? 1 : 0;
        return {};
    });
}

splat_result splat_mesh_write_views(splat_mesh mesh, splat_device device,
                                    const splat_mesh_views_desc* desc) {
    return api::with(mesh, [&](const auto& object) -> Status {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        SPLAT_ASSIGN(const ViewsDesc value, views_desc_of(desc));
        SPLAT_ASSIGN(const bool is_there, mesh_views::has_object(value));
        if (is_there) return {};
        // The mesh's mutex is locked after the device's, so both are held while files are written.
        return owner->context->mutex.call([&]() -> Status {
            const std::shared_lock lock(object->mutex);
            SPLAT_ASSIGN(const mesh_views::Draw draw,
                         drawer_of(*owner->context, object->mesh, value));
            return mesh_views::write_object(value, object->mesh, draw);
        });
    });
}
