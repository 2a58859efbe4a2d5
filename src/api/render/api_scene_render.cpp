#include <mutex>
#include <shared_mutex>

#include "api/render/raster_calls.h"
#include "api/scene/drawn_as.h"

using namespace splat;

namespace {

/// One view of a call, checked.
struct SceneView {
    splat_rasterizer_desc desc{};  ///< makes the rasterizer that draws it
    raster::PackedViews camera;
    api::ImageView image;
};

/// Takes the copies of a device out of a scene when a call ends, so that they do not keep it open.
struct CopiesRemover {
    api::SceneObject& scene;
    const vk::Context* context;  ///< nullptr: they stay

    ~CopiesRemover() {
        const std::shared_lock reading(scene.mutex);
        const std::lock_guard lock(scene.copies_mutex);
        std::erase_if(scene.copies,
                      [&](const auto& copy) { return copy->context.get() == context; });
    }
};

splat_rasterizer_desc rasterizer_of(api::SceneObject& scene, const splat_scene_render_desc& desc) {
    const std::shared_lock reading(scene.mutex);
    splat_rasterizer_desc made{};
    made.gaussians = static_cast<std::uint32_t>(scene.gaussians.count());
    made.sh_degree = scene.gaussians.sh_degree;
    made.views = 1;
    made.flags = desc.flags;
    if (desc.as_given == 0) made.flags |= api::drawn_bits(scene.gaussians.drawn_as);
    made.convention = desc.convention;
    if (desc.output >= SPLAT_OUTPUT_DEPTH && desc.output <= SPLAT_OUTPUT_CONTRIBUTORS)
        made.flags |= SPLAT_RASTERIZER_DEPTH;
    if (desc.output == SPLAT_OUTPUT_IDS) made.flags |= SPLAT_RASTERIZER_IDS;
    if (desc.output == SPLAT_OUTPUT_MEDIAN_DEPTH) made.flags |= SPLAT_RASTERIZER_MEDIAN_DEPTH;
    if (desc.output == SPLAT_OUTPUT_NORMALS) made.flags |= SPLAT_RASTERIZER_NORMALS;
    return made;
}

Result<SceneView> check_view(const vk::DeviceInfo& device, const splat_scene_render_desc& desc,
                             splat_rasterizer_desc rasterizer, const splat_camera* cameras,
                             const splat_image* images, std::uint32_t i) {
    SceneView view;
    rasterizer.width = cameras[i].width;
    rasterizer.height = cameras[i].height;
    view.desc = rasterizer;
    SPLAT_ASSIGN(raster::RasterDesc made, api::raster_desc_of(rasterizer));
    made = api::band_desc(device, made);
    SPLAT_TRY(raster::check_desc(device, made));
    const bool linear = (rasterizer.flags & SPLAT_RASTERIZER_LINEAR_COLORS) != 0;
    SPLAT_ASSIGN(const auto background, api::background_of(desc.background, linear));
    SPLAT_ASSIGN(view.camera, api::pack_cameras(made, cameras, i, 1, background));
    SPLAT_ASSIGN(view.image, api::image_of_output(desc.output, made, images[i],
                                                  format("images[%u]", i).c_str()));
    return view;
}

Status draw(api::DeviceObject& device, api::SceneObject& scene, splat_output output,
            std::span<const SceneView> views) {
    const vk::DeviceCall call(device.context->mutex);
    std::shared_ptr<api::RasterizerObject> rasterizer;
    for (const SceneView& view : views) {
        if (rasterizer == nullptr || rasterizer->desc.width != view.desc.width ||
            rasterizer->desc.height != view.desc.height) {
            rasterizer.reset();
            SPLAT_ASSIGN(rasterizer, api::make_rasterizer(device, view.desc));
        }
        SPLAT_TRY(api::draw_scene(*rasterizer->default_state, scene, view.camera));
        const std::lock_guard lock(device.context->mutex);
        SPLAT_TRY(api::fill_images(*rasterizer->default_state, output, 0, {&view.image, 1}));
    }
    return {};
}

}  // namespace

splat_result splat_scene_render(splat_scene scene, splat_device device, const splat_camera* cameras,
                                uint32_t count, const splat_scene_render_desc* desc,
                                const splat_image* images) {
    return api::with(scene, [&](const auto& from) -> Status {
        splat_scene_render_desc wanted{};
        if (desc != nullptr) {
            SPLAT_TRY(api::check_desc(desc, api::kDrawnBits));
            if (desc->as_given > 1)
                return invalid("splat_scene_render_desc.as_given is %u, expected 0 or 1",
                               desc->as_given);
            wanted = *desc;
        }
        if (wanted.output == 0) wanted.output = SPLAT_OUTPUT_RGB;
        if (count > 0) {
            SPLAT_TRY(api::require(cameras, "cameras", images, "images"));
        }
        std::shared_ptr<api::DeviceObject> owner;
        if (device != nullptr) {
            SPLAT_ASSIGN(owner, api::find(device));
        } else {
            SPLAT_SET(owner, api::open_device({}));
        }
        const vk::DeviceInfo& limits = owner->context->device().info();
        const splat_rasterizer_desc rasterizer = rasterizer_of(*from, wanted);
        std::vector<SceneView> views;
        for (std::uint32_t i = 0; i < count; ++i) {
            SPLAT_ASSIGN(SceneView view,
                         check_view(limits, wanted, rasterizer, cameras, images, i));
            views.push_back(std::move(view));
        }
        const CopiesRemover remover{*from, device == nullptr ? owner->context.get() : nullptr};
        return draw(*owner, *from, wanted.output, views);
    });
}
