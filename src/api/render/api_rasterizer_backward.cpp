#include "api/api_guard.h"
#include "api/core/tensor_arguments.h"
#include "ops/gaussian_rows.h"
#include "ops/strided_copy.h"

using namespace splat;

namespace {

/// The tensors of a splat_gradients_desc.
struct GradientTensors {
    vk::BufferView rgb, alpha, depth;
    ops::GaussianRows attributes;
    vk::BufferView means2d, means2d_abs, pose, intrinsics, contributions;
};

Status check_made_for(bool made, const char* name, const char* flag) {
    if (made) return {};
    return bad_state("%s needs a rasterizer made %s", name, flag);
}

/// Errors: kInvalidState for a tensor that this rasterizer was not made for.
Status check_purpose(const raster::RasterDesc& desc, const splat_gradients_desc& from) {
    SPLAT_TRY(check_made_for(desc.backward, "backward", "with SPLAT_RASTERIZER_BACKWARD"));
    SPLAT_TRY(check_made_for(desc.grad_depth || from.grad_depth == nullptr, "grad_depth",
                             "with SPLAT_RASTERIZER_GRAD_DEPTH"));
    SPLAT_TRY(check_made_for(desc.grad_pose || from.grad_world_to_camera == nullptr,
                             "grad_world_to_camera", "with SPLAT_RASTERIZER_GRAD_POSE"));
    SPLAT_TRY(check_made_for(desc.grad_intrinsics || from.grad_intrinsics == nullptr,
                             "grad_intrinsics", "with SPLAT_RASTERIZER_GRAD_INTRINSICS"));
    SPLAT_TRY(check_made_for(desc.contributions || from.contributions == nullptr, "contributions",
                             "with SPLAT_RASTERIZER_CONTRIBUTIONS"));
    SPLAT_TRY(check_made_for(desc.export_gradients || from.grad_means2d == nullptr, "grad_means2d",
                             "with SPLAT_RASTERIZER_GRAD_MEANS2D"));
    SPLAT_TRY(check_made_for(desc.export_gradients || from.grad_means2d_abs == nullptr,
                             "grad_means2d_abs", "with SPLAT_RASTERIZER_GRAD_MEANS2D"));
    SPLAT_TRY(check_made_for(!desc.direct_colors || from.grad_sh == nullptr, "grad_sh",
                             "without SPLAT_RASTERIZER_DIRECT_COLORS"));
    return check_made_for(desc.direct_colors || from.grad_colors == nullptr, "grad_colors",
                          "with SPLAT_RASTERIZER_DIRECT_COLORS");
}

Status check_tensors(api::TensorArguments& list, const raster::RasterDesc& desc,
                     const splat_gradients_desc& from, GradientTensors& to) {
    const std::int64_t v = desc.views;
    const std::int64_t h = desc.height;
    const std::int64_t w = desc.width;
    const std::int64_t n = desc.gaussians;
    const std::int64_t k = scene::sh_coefficients(desc.sh_degree);
    SPLAT_TRY(list.read(from.grad_rgb, "grad_rgb", {v, h, w, 3}, to.rgb));
    SPLAT_TRY(list.read(from.grad_alpha, "grad_alpha", {v, h, w}, to.alpha));
    SPLAT_TRY(list.read(from.grad_depth, "grad_depth", {v, h, w}, to.depth));
    ops::GaussianRows& a = to.attributes;
    SPLAT_TRY(list.write(from.grad_means, "grad_means", {n, 3}, a.means));
    SPLAT_TRY(list.write(from.grad_scales, "grad_scales", {n, 3}, a.scales));
    SPLAT_TRY(list.write(from.grad_rotations, "grad_rotations", {n, 4}, a.rotations));
    SPLAT_TRY(list.write(from.grad_opacities, "grad_opacities", {n}, a.opacities));
    SPLAT_TRY(list.write(from.grad_sh, "grad_sh", {n, k, 3}, a.colors));
    SPLAT_TRY(list.write(from.grad_colors, "grad_colors", {n, 3}, a.colors));
    const auto items = static_cast<std::int64_t>(desc.items());
    if (items == v * n) {
        SPLAT_TRY(list.write(from.grad_means2d, "grad_means2d", {v, n, 2}, to.means2d));
        SPLAT_TRY(list.write(from.grad_means2d_abs, "grad_means2d_abs", {v, n, 2}, to.means2d_abs));
    } else {
        SPLAT_TRY(list.write(from.grad_means2d, "grad_means2d", {items, 2}, to.means2d));
        SPLAT_TRY(
            list.write(from.grad_means2d_abs, "grad_means2d_abs", {items, 2}, to.means2d_abs));
    }
    SPLAT_TRY(list.write(from.grad_intrinsics, "grad_intrinsics", {v, 4}, to.intrinsics));
    SPLAT_TRY(list.write(from.contributions, "contributions", {n, 2}, to.contributions));
    return list.write(from.grad_world_to_camera, "grad_world_to_camera", {v, 3, 4}, to.pose);
}

bool present(const vk::BufferView& view) {
    return view.buffer != VK_NULL_HANDLE;
}

/// Copy the gradients with respect to the outputs into the kernels' layout.
Status pack(api::RasterStateObject& object, const GradientTensors& tensors) {
    const std::uint64_t pixels = object.rasterizer->drawn_desc().pixels();
    const vk::BufferView& image = object.gradients->image.range();
    vk::Recorder recorder(*object.context);
    SPLAT_TRY(recorder.fill(image, 0));
    SPLAT_TRY(recorder.fill(object.gradients->depth.range(), 0));
    if (present(tensors.rgb))
        SPLAT_TRY(
            ops::strided_copy(recorder, {pixels, 3, {3, 0}, {4, 0}, false}, tensors.rgb, image));
    if (present(tensors.alpha))
        SPLAT_TRY(
            ops::strided_copy(recorder, {pixels, 1, {1, 0}, {4, 3}, false}, tensors.alpha, image));
    if (present(tensors.depth))
        SPLAT_TRY(ops::strided_copy(recorder, {pixels, 1, {1, 0}, {1, 0}, false}, tensors.depth,
                                    object.gradients->depth.range()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return object.context->run(list);
}

/// Copy the gradients with respect to the inputs out of the kernels' layout.
Status unpack(api::RasterStateObject& object, const GradientTensors& tensors, bool accumulate) {
    const raster::RasterDesc& desc = object.rasterizer->drawn_desc();
    const raster::Workspace& space = object.rasterizer->workspace();
    vk::Recorder recorder(*object.context);
    SPLAT_TRY(ops::unpack_rows(recorder, desc, object.gradients->gaussians.views(),
                               tensors.attributes, accumulate));
    if (present(tensors.means2d))
        SPLAT_TRY(ops::strided_copy(recorder, {desc.items(), 2, {12, 0}, {2, 0}, accumulate},
                                    space.exported.range(), tensors.means2d));
    if (present(tensors.means2d_abs))
        SPLAT_TRY(ops::strided_copy(recorder, {desc.items(), 2, {12, 2}, {2, 0}, accumulate},
                                    space.exported.range(), tensors.means2d_abs));
    if (present(tensors.pose))
        SPLAT_TRY(ops::strided_copy(recorder, {desc.views, 12, {12, 0}, {12, 0}, accumulate},
                                    space.pose.range(), tensors.pose));
    if (present(tensors.intrinsics))
        SPLAT_TRY(ops::strided_copy(recorder, {desc.views, 4, {4, 0}, {4, 0}, accumulate},
                                    space.intrinsics.range(), tensors.intrinsics));
    if (present(tensors.contributions))
        SPLAT_TRY(ops::strided_copy(recorder, {desc.gaussians, 2, {2, 0}, {2, 0}, accumulate},
                                    space.contributions.range(), tensors.contributions));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return object.context->run(list);
}

}  // namespace

splat_result splat_rasterizer_backward(splat_rasterizer rasterizer, splat_raster_state state,
                                       const splat_gradients_desc* gradients) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_TRY(api::check_desc(gradients, SPLAT_GRADIENTS_ACCUMULATE));
        SPLAT_TRY(check_purpose(object->rasterizer->desc(), *gradients));
        api::TensorArguments arguments(*object->context, "rasterizer");
        GradientTensors tensors;
        const std::lock_guard lock(object->context->mutex);
        if (!object->rasterizer->drawn())
            return bad_state(
                "the rasterizer has drawn nothing: call splat_rasterizer_forward first");
        SPLAT_TRY(check_tensors(arguments, object->rasterizer->drawn_desc(), *gradients, tensors));
        SPLAT_TRY(arguments.check_unmapped());
        SPLAT_TRY(pack(*object, tensors));
        api::RasterGradients& made = *object->gradients;
        SPLAT_TRY(object->rasterizer->backward(made.image.range(), made.depth.range(),
                                               made.gaussians.views()));
        return unpack(*object, tensors, (gradients->flags & SPLAT_GRADIENTS_ACCUMULATE) != 0);
    });
}
