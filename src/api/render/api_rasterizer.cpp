#include "api/render/raster_calls.h"

#include <cmath>
#include <shared_mutex>

#include "api/core/tensor_arguments.h"
#include "api/scene/camera_value.h"
#include "core/log.h"
#include "ops/gaussian_rows.h"
#include "raster/bands.h"
#include "scene/arrays.h"
#include "scene/srgb.h"

using namespace splat;

namespace {

using RasterizerPointer = std::shared_ptr<api::RasterizerObject>;
using StatePointer = std::shared_ptr<api::RasterStateObject>;
using CopyPointer = std::shared_ptr<api::SceneCopy>;

/// Memory for the gradients with respect to the images of desc.views views. The context's mutex is held.
Status make_image_gradients(api::RasterGradients& made, const raster::RasterDesc& desc) {
    vk::Memory& memory = made.context->memory();
    SPLAT_ASSIGN(vk::Buffer image, memory.allocate(desc.pixels() * 16, vk::MemoryKind::kDevice,
                                                   "gradient of the image"));
    const std::uint64_t depth = desc.grad_depth ? vk::quad_bytes(desc.pixels()) : 16;
    SPLAT_ASSIGN(made.depth,
                 memory.allocate(depth, vk::MemoryKind::kDevice, "gradient of the depth"));
    made.image = std::move(image);
    return {};
}

/// Allocate the gradients at creation, so that a backward call cannot run out of memory for them.
Result<std::shared_ptr<api::RasterGradients>> make_gradients(
    const std::shared_ptr<vk::Context>& context, const raster::RasterDesc& desc) {
    auto made = std::make_shared<api::RasterGradients>(context);
    const std::lock_guard lock(context->mutex);
    SPLAT_TRY(context->device().alive());
    if (!desc.backward) return made;
    SPLAT_ASSIGN(made->gaussians, gaussians::allocate_set(*context, desc));
    SPLAT_TRY(make_image_gradients(*made, desc));
    return made;
}

Result<StatePointer> make_state(const api::RasterizerObject& rasterizer) {
    auto state = std::make_shared<api::RasterStateObject>(rasterizer.context);
    state->gradients = rasterizer.gradients;
    state->any_views = rasterizer.any_views;
    state->gaussians = rasterizer.gaussians;
    state->linear_colors = rasterizer.linear_colors;
    const std::lock_guard lock(state->context->mutex);
    SPLAT_TRY(state->context->device().alive());
    SPLAT_ASSIGN(state->rasterizer, raster::Rasterizer::create(*state->context, rasterizer.desc));
    state->describe();
    return state;
}

using Ranges = std::vector<raster::Range>;

/// The ranges of a call's views; none: each sees all.
Result<Ranges> ranges_of(const splat_gaussians_desc& from, std::uint32_t views) {
    Ranges ranges;
    if (from.view_range_count > 0)
        SPLAT_TRY(api::require(from.view_ranges, "splat_gaussians_desc.view_ranges"));
    if (from.view_ranges == nullptr) return ranges;
    if (from.view_range_count != std::size_t{2} * views)
        return invalid(
            "splat_gaussians_desc.view_range_count is %zu, expected %llu: two numbers for each "
            "view",
            from.view_range_count, llu(std::uint64_t{2} * views));
    for (std::size_t v = 0; v < views; ++v)
        ranges.push_back({from.view_ranges[2 * v], from.view_ranges[2 * v + 1]});
    return ranges;
}

/// The same with room for the views and items of a call.
raster::RasterDesc with_room(raster::RasterDesc desc, std::uint32_t views, std::uint64_t items) {
    const std::uint64_t most = std::max(desc.items(), items);
    desc.views = std::max(desc.views, views);
    desc.most_items = most;
    return desc;
}

/// Let the views of a call see ranges of `gaussians`, if there are any. Take more memory if a call has more views or
/// items than any before. On an error all stays as it was. The context's mutex is held.
Status make_room(api::RasterStateObject& object, std::uint32_t gaussians, const Ranges& ranges,
                 raster::PackedViews& views) {
    raster::RasterDesc desc = object.rasterizer->desc();
    const std::uint64_t all = std::uint64_t{desc.gaussians} * views.count();
    if (object.any_views) desc = with_room(desc, views.count(), all);
    if (!ranges.empty())
        SPLAT_TRY(
            raster::see_ranges(object.context->device().info(), desc, gaussians, ranges, views));
    const raster::RasterDesc& before = object.rasterizer->desc();
    const std::uint64_t items = ranges.empty() ? all : views.items;
    if (!object.any_views) return raster::check_items(desc, gaussians, views);
    if (views.count() <= before.views && items <= before.items()) return {};
    desc = with_room(before, views.count(), items);
    SPLAT_TRY(object.context->device().alive());
    SPLAT_ASSIGN(auto larger, raster::Rasterizer::create(*object.context, desc));
    // Lists of other states that name the old gradients are recorded anew, because the range differs.
    if (desc.backward && object.gradients->image.bytes() < desc.pixels() * 16)
        SPLAT_TRY(make_image_gradients(*object.gradients, desc));
    object.rasterizer = std::move(larger);
    return {};
}

/// For the holder of the scene's mutex, as the next function.
Status check_scene(const api::SceneObject& scene, const api::RasterStateObject& object) {
    if (object.rasterizer->desc().direct_colors)
        return bad_state(
            "the rasterizer was made for direct colours, but a scene has spherical "
            "harmonics");
    if (scene.gaussians.count() <= object.gaussians) return {};
    return invalid("the scene has %zu Gaussians, but the rasterizer was made for at most %u",
                   scene.gaussians.count(), object.gaussians);
}

/// The scene's copy on the rasterizer's device, of its degree; uploaded if there is none. The
/// caller holds the device's mutex.
Result<CopyPointer> copy_of(api::SceneObject& scene, const api::RasterStateObject& object) {
    raster::RasterDesc desc = object.rasterizer->desc();
    desc.gaussians = static_cast<std::uint32_t>(scene.gaussians.count());
    const std::lock_guard lock(scene.copies_mutex);
    for (const CopyPointer& copy : scene.copies)
        if (copy->context == object.context && copy->set.desc.sh_degree == desc.sh_degree)
            return copy;
    auto copy = std::make_shared<api::SceneCopy>(object.context);
    SPLAT_TRY(object.context->device().alive());
    SPLAT_ASSIGN(copy->set, gaussians::allocate_set(*object.context, desc));
    SPLAT_TRY(gaussians::upload(*object.context, scene.gaussians, copy->set));
    scene.copies.push_back(copy);
    return copy;
}

/// The number of Gaussians that a call's tensors hold. Errors: kInvalidArgument beyond the capacity.
Result<std::uint32_t> gaussians_in(const raster::RasterDesc& desc,
                                   const splat_gaussians_desc& from) {
    if (from.means == nullptr) return std::uint32_t{0};
    SPLAT_ASSIGN(const auto means, api::Tensors::find(from.means, "means"));
    const std::uint32_t count = means->view.shape.rank() == 0 ? 0 : means->view.shape[0];
    if (count <= desc.gaussians) return count;
    return error(Code::kShape,
                 "means has the shape %s, but the rasterizer was made for at most %u Gaussians",
                 means->view.shape.text().c_str(), desc.gaussians);
}

bool has_tensors(const splat_gaussians_desc& from) {
    return from.means != nullptr || from.scales != nullptr || from.rotations != nullptr ||
           from.opacities != nullptr || from.sh != nullptr || from.colors != nullptr;
}

/// Check the tensors of desc.gaussians Gaussians and put their views into `to`.
Status check_gaussians(api::TensorArguments& arguments, const raster::RasterDesc& desc,
                       const splat_gaussians_desc& from, ops::GaussianRows& to) {
    const std::int64_t n = desc.gaussians;
    const std::int64_t k = scene::sh_coefficients(desc.sh_degree);
    if (has_tensors(from)) {
        SPLAT_TRY(api::require(from.means, "splat_gaussians_desc.means", from.scales,
                               "splat_gaussians_desc.scales", from.rotations,
                               "splat_gaussians_desc.rotations", from.opacities,
                               "splat_gaussians_desc.opacities"));
        SPLAT_TRY(desc.direct_colors ? api::require(from.colors, "splat_gaussians_desc.colors")
                                     : api::require(from.sh, "splat_gaussians_desc.sh"));
    }
    if ((desc.direct_colors ? from.sh : from.colors) != nullptr)
        return invalid(
            "splat_gaussians_desc.%s is not NULL, but the rasterizer was made %s direct "
            "colours",
            desc.direct_colors ? "sh" : "colors", desc.direct_colors ? "for" : "without");
    SPLAT_TRY(arguments.read(from.means, "means", {n, 3}, to.means));
    SPLAT_TRY(arguments.read(from.scales, "scales", {n, 3}, to.scales));
    SPLAT_TRY(arguments.read(from.rotations, "rotations", {n, 4}, to.rotations));
    SPLAT_TRY(arguments.read(from.opacities, "opacities", {n}, to.opacities));
    SPLAT_TRY(arguments.read(from.colors, "colors", {n, 3}, to.colors));
    return arguments.read(from.sh, "sh", {n, k, 3}, to.colors);
}

/// Keeps the scene that the rasterizer's command lists name when a call ends: the one drawn, or the
/// one before if the call failed before it recorded.
struct NamedSceneKeeper {
    api::RasterStateObject& object;
    CopyPointer& drawn;

    ~NamedSceneKeeper() {
        if (object.rasterizer->names(drawn->set.views())) std::swap(object.scene, drawn);
    }
};

/// Memory for the Gaussians of calls without a copy of a scene.
Status make_inputs(api::RasterStateObject& object) {
    if (object.inputs.bytes() == 0)
        SPLAT_SET(object.inputs,
                  gaussians::allocate_set(*object.context, object.rasterizer->desc()));
    return {};
}

/// Draw a scene of more Gaussians than the device takes at a time.
Status draw_in_bands(api::RasterStateObject& object, const scene::Gaussians& scene,
                     const raster::PackedViews& views, bool ranged) {
    const raster::RasterDesc& desc = object.rasterizer->desc();
    if (views.count() != 1 || !views.active_tiles.empty() || ranged)
        return unsupported(
            "%zu Gaussians are drawn in bands, because the device takes %u at a time: one view a "
            "call, with all of its tiles and Gaussians",
            scene.count(), desc.gaussians);
    SPLAT_ASSIGN(const raster::Bands bands, raster::divide(scene, desc, views, desc.gaussians));
    SPLAT_TRY(make_inputs(object));
    const auto load = [&](const raster::Window& band) -> Result<gaussians::SetViews> {
        const scene::Gaussians part = scene::gather(scene, bands.gaussians_of(band));
        SPLAT_TRY(gaussians::upload(*object.context, part, object.inputs));
        return object.inputs.views();
    };
    const Status done = object.rasterizer->forward_in_bands(scene.count(), bands.rows, load, views);
    if (object.scene != nullptr && !object.rasterizer->names(object.scene->set.views()))
        object.scene.reset();
    object.describe();
    return done;
}

/// Copy `desc.gaussians` Gaussians into the kernels' layout.
Status pack(api::RasterStateObject& object, const raster::RasterDesc& desc,
            const ops::GaussianRows& attributes) {
    SPLAT_TRY(make_inputs(object));
    object.inputs.count = desc.gaussians;
    object.inputs.version = 0;  // a scene drawn in bands left its own
    object.inputs.sh_degree = scene::kMaxShDegree;
    vk::Recorder recorder(*object.context);
    SPLAT_TRY(ops::pack_rows(recorder, desc, attributes, object.inputs.views()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(object.context->make_ready(list));
    object.rasterizer->invalidate();
    return object.context->run(list);
}

Status forward(api::RasterStateObject& object, const gaussians::SetViews& scene,
               const raster::PackedViews& views) {
    const Status done = object.rasterizer->forward(scene, views);
    object.describe();
    return done;
}

/// Draw Gaussians that are tensors.
Status draw_tensors(api::RasterStateObject& object, const splat_gaussians_desc& from,
                    raster::PackedViews views, const Ranges& ranges) {
    raster::RasterDesc desc = object.rasterizer->desc();
    SPLAT_ASSIGN(desc.gaussians, gaussians_in(desc, from));
    api::TensorArguments arguments(*object.context, "rasterizer");
    ops::GaussianRows attributes;
    SPLAT_TRY(check_gaussians(arguments, desc, from, attributes));
    const std::lock_guard lock(object.context->mutex);
    SPLAT_TRY(arguments.check_unmapped());
    SPLAT_TRY(make_room(object, desc.gaussians, ranges, views));
    SPLAT_TRY(pack(object, desc, attributes));
    const Status done = forward(object, object.inputs.views(), views);
    if (object.scene != nullptr && !object.rasterizer->names(object.scene->set.views()))
        object.scene.reset();  // drawn before
    return done;
}

}  // namespace

Result<RasterizerPointer> api::make_rasterizer(DeviceObject& device,
                                               const splat_rasterizer_desc& from) {
    auto object = std::make_shared<RasterizerObject>(device.context);
    SPLAT_ASSIGN(object->desc, raster_desc_of(from));
    object->any_views = from.views == 0;
    object->gaussians = from.gaussians;
    object->desc = band_desc(device.context->device().info(), object->desc);
    object->linear_colors = (from.flags & SPLAT_RASTERIZER_LINEAR_COLORS) != 0;
    SPLAT_TRY(raster::check_desc(device.context->device().info(), object->desc));
    SPLAT_TRY(device.test(kRasterKernels | (object->desc.backward ? kRasterGradientKernels : 0U)));
    SPLAT_ASSIGN(object->gradients, make_gradients(device.context, object->desc));
    SPLAT_ASSIGN(object->default_state, make_state(*object));
    return object;
}

Result<std::array<float, 3>> api::background_of(const float* background, bool linear) {
    std::array<float, 3> color{};
    for (std::size_t k = 0; background != nullptr && k < 3; ++k) {
        if (!std::isfinite(background[k]))
            return invalid("background[%zu] is %g, expected a finite number", k,
                           static_cast<double>(background[k]));
        color[k] = linear ? scene::linear_of_srgb(background[k]) : background[k];
    }
    return color;
}

Result<raster::PackedViews> api::views_of_call(const RasterStateObject& object,
                                               const splat_camera* cameras, std::uint32_t count,
                                               const float* background,
                                               std::span<const raster::Range> ranges) {
    raster::RasterDesc desc = object.rasterizer->desc();
    if (count > 0) SPLAT_TRY(api::require(cameras, "cameras"));
    if (object.any_views && count > desc.views) {
        std::uint64_t items = ranges.empty() ? std::uint64_t{desc.gaussians} * count : 0;
        for (const raster::Range& range : ranges) items += range.count;
        desc = with_room(desc, count, items);
        SPLAT_TRY(raster::check_desc(object.context->device().info(), desc));
    }
    if (count > desc.views)
        return invalid("count is %u, but the rasterizer was made for at most %u views", count,
                       desc.views);
    SPLAT_ASSIGN(const auto color, api::background_of(background, object.linear_colors));
    return api::pack_cameras(desc, cameras, 0, count, color);
}

void api::warn_of_drawn_as(const RasterStateObject& object, SceneObject& scene) {
    const raster::RasterDesc& desc = object.rasterizer->desc();
    scene::DrawnAs lacking;
    {
        const std::shared_lock reading(scene.mutex);
        lacking = scene.gaussians.drawn_as;
    }
    lacking.antialiased = lacking.antialiased && !desc.antialiased;
    lacking.by_distance = lacking.by_distance && !desc.sort_by_distance;
    lacking.three_sigma = lacking.three_sigma && !desc.cut_3_sigma;
    lacking.linear_colors = lacking.linear_colors && !object.linear_colors;
    if (lacking == scene::DrawnAs() || scene.warned.exchange(true)) return;
    std::string names;
    for (const std::string& name : scene::drawn_as_names(lacking))
        names += (names.empty() ? "" : ", ") + name;
    log(LogLevel::kWarning,
        format("the scene's file says to draw it %s, which the rasterizer was not made for: add "
               "splat_scene_info.drawn_as to splat_rasterizer_desc.flags",
               names.c_str()));
}

Result<raster::PackedViews> api::pack_cameras(const raster::RasterDesc& desc,
                                              const splat_camera* cameras, std::uint32_t first,
                                              std::uint32_t count,
                                              const std::array<float, 3>& background) {
    std::vector<scene::Camera> views;
    for (std::uint32_t i = first; i < first + count; ++i)
        views.push_back(camera_of(cameras[i], format("cameras[%u]", i)));
    return raster::pack_views(desc, views, background);
}

Status api::draw_scene(RasterStateObject& object, SceneObject& scene, raster::PackedViews views,
                       std::span<const raster::Range> ranges, const Draw& draw) {
    const std::lock_guard lock(object.context->mutex);
    std::shared_lock reading(scene.mutex);
    SPLAT_TRY(check_scene(scene, object));
    const std::uint32_t most = object.rasterizer->desc().gaussians;
    if (draw && scene.gaussians.count() > most)
        return unsupported(
            "%zu Gaussians are drawn in bands, because the device takes %u at a time: use "
            "splat_rasterizer_forward, which waits for each",
            scene.gaussians.count(), most);
    if (scene.gaussians.count() > most)
        return draw_in_bands(object, scene.gaussians, views, !ranges.empty());
    SPLAT_ASSIGN(CopyPointer copy, copy_of(scene, object));
    reading.unlock();
    SPLAT_TRY(make_room(object, copy->set.count, {ranges.begin(), ranges.end()}, views));
    const NamedSceneKeeper keeper{object, copy};
    if (draw) return draw(copy->set.views(), views);
    return forward(object, copy->set.views(), views);
}

void api::RasterStateObject::describe() {
    const raster::RasterStats& stats = rasterizer->stats();
    splat_rasterizer_info filled{};
    filled.bytes = rasterizer->workspace().bytes() + inputs.bytes() + gradients->bytes();
    if (rasterizer->drawn()) {
        SPLAT_COPY(filled, stats, passes, visible, culled, non_finite, pairs, longest, tiles,
                   empty_tiles, runs);
        filled.gaussians = stats.banded != 0 ? static_cast<std::uint32_t>(stats.banded)
                                             : rasterizer->drawn_desc().gaussians;
        filled.views = rasterizer->drawn_desc().views;
        filled.items = static_cast<std::uint32_t>(
            stats.banded != 0 ? stats.banded : rasterizer->drawn_desc().items());
    }
    info.set(filled);
}

Result<std::shared_ptr<api::RasterStateObject>> api::find_state(splat_rasterizer rasterizer,
                                                                splat_raster_state state) {
    SPLAT_ASSIGN(const auto object, Rasterizers::find(rasterizer, "rasterizer"));
    if (state == nullptr) return object->default_state;
    SPLAT_ASSIGN(const auto found, RasterStates::find(state, "state"));
    if (found->gradients != object->gradients)
        return invalid(
            "state was made for another rasterizer, expected one of "
            "splat_raster_state_create(rasterizer, ...) or NULL");
    return found;
}

splat_result splat_rasterizer_create(splat_device device, const splat_rasterizer_desc* desc,
                                     splat_rasterizer* rasterizer) {
    return api::create(rasterizer, [&]() -> Result<RasterizerPointer> {
        SPLAT_ASSIGN(const auto owner, api::find(device));
        constexpr std::uint32_t kKnown = 2 * SPLAT_RASTERIZER_MEDIAN_DEPTH - 1;
        SPLAT_TRY(api::check_desc(desc, kKnown));
        return api::make_rasterizer(*owner, *desc);
    });
}

splat_result splat_raster_state_create(splat_rasterizer rasterizer, splat_raster_state* state) {
    return api::create_of(rasterizer, state,
                          [](const auto& object) { return make_state(*object); });
}

splat_result splat_rasterizer_forward_scene(splat_rasterizer rasterizer, splat_raster_state state,
                                            splat_scene scene, const splat_camera* cameras,
                                            uint32_t count, const float* background) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_ASSIGN(const auto from, api::find(scene));
        SPLAT_ASSIGN(const raster::PackedViews views,
                     api::views_of_call(*object, cameras, count, background));
        api::warn_of_drawn_as(*object, *from);
        return api::draw_scene(*object, *from, views);
    });
}

splat_result splat_rasterizer_forward(splat_rasterizer rasterizer, splat_raster_state state,
                                      const splat_gaussians_desc* gaussians,
                                      const splat_camera* cameras, uint32_t count,
                                      const float* background) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_TRY(api::check_desc(gaussians, 0));
        splat_gaussians_desc given{};
        SPLAT_TRY(api::take_input(gaussians, "gaussians", given));
        SPLAT_ASSIGN(const Ranges ranges, ranges_of(given, count));
        SPLAT_ASSIGN(raster::PackedViews views,
                     api::views_of_call(*object, cameras, count, background, ranges));
        if (given.active_tile_count > 0)
            SPLAT_TRY(api::require(given.active_tiles, "splat_gaussians_desc.active_tiles"));
        if (given.active_tiles != nullptr)
            SPLAT_TRY(raster::mask_tiles(object->rasterizer->desc(),
                                         {given.active_tiles, given.active_tile_count}, views));
        if (given.scene == nullptr) return draw_tensors(*object, given, std::move(views), ranges);
        if (has_tensors(given))
            return invalid("scene and tensors are both given, expected one of them");
        SPLAT_ASSIGN(const auto from, api::find(given.scene));
        api::warn_of_drawn_as(*object, *from);
        return api::draw_scene(*object, *from, std::move(views), ranges);
    });
}

splat_result splat_rasterizer_get_info(splat_rasterizer rasterizer, splat_raster_state state,
                                       splat_rasterizer_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_TRY(api::check_fill(info, "info"));
        api::give(object->info.get(), info);
        return {};
    });
}
