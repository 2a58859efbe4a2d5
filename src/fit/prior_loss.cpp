#include "fit/prior_loss.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/fit_params.h"
#include "vk/launch.h"

namespace splat::fit {
namespace {

constexpr std::uint32_t kPriorChunk = 1024;  ///< pixels per workgroup that sums
constexpr std::uint32_t kPriorGroup = 64;
constexpr std::uint32_t kPriorPlanes = 4;  ///< partial sums: two to align, normals, depth

std::uint64_t pixels(const PriorLossDesc& desc) {
    return std::uint64_t{desc.camera.width} * desc.camera.height;
}

std::uint32_t chunks(const PriorLossDesc& desc) {
    return static_cast<std::uint32_t>(ceil_div(pixels(desc), kPriorChunk));
}

float float_of(double value) {
    return static_cast<float>(value);
}

params::PriorLossParams push_of(const PriorLossDesc& desc, const PriorCounts& counts,
                                double share) {
    const scene::Camera& camera = desc.camera;
    params::PriorLossParams push{};
    push.width = camera.width;
    push.height = camera.height;
    push.chunk = kPriorChunk;
    push.chunks = chunks(desc);
    push.image = static_cast<std::uint32_t>(desc.view * pixels(desc));
    push.fx = float_of(camera.fx);
    push.fy = float_of(camera.fy);
    push.cx = float_of(camera.cx);
    push.cy = float_of(camera.cy);
    push.depth_scale = float_of(desc.depth_weight * share / std::max(counts.depth, 1U));
    push.normal_scale = float_of(desc.normal_weight * share / std::max(counts.normal, 1U));
    if (desc.alignment) {
        push.aligned = 1;
        push.scale = float_of(desc.alignment->scale);
        push.shift = float_of(desc.alignment->shift);
        push.inverse_mean = float_of(1 / desc.alignment->mean);
    }
    return push;
}

Status check(const vk::Recorder& recorder, const PriorLossDesc& desc, const PriorLossViews& views) {
    if (pixels(desc) == 0)
        return invalid("prior_loss: a view of %u x %u pixels", desc.camera.width,
                       desc.camera.height);
    const std::uint64_t drawn = pixels(desc) * (desc.view + 1);
    const struct {
        const char* name;
        std::uint64_t bytes, least;
    } needs[] = {{"image", views.image.bytes, 16 * drawn},
                 {"extra", views.extra.bytes, 16 * drawn},
                 {"map", views.map.bytes, 8 * pixels(desc)},
                 {"workspace", views.workspace.bytes, prior_loss_workspace(recorder, desc)},
                 {"grad_depth", views.grad_depth.bytes, 4 * drawn},
                 {"grad_image", views.grad_image.bytes, 16 * drawn},
                 {"partial", views.partial.bytes, prior_loss_partial(desc)}};
    for (const auto& [name, bytes, least] : needs)
        if (bytes < least)
            return error(Code::kShape, "prior_loss: '%s' has %llu bytes, expected %llu", name,
                         llu(bytes), llu(least));
    return {};
}

}  // namespace

std::uint64_t prior_loss_workspace(const vk::Recorder& recorder, const PriorLossDesc& desc) {
    return round_up(16 * pixels(desc), recorder.device().limits.offset_alignment) + 16;
}

std::uint64_t prior_loss_partial(const PriorLossDesc& desc) {
    return std::uint64_t{16} * kPriorPlanes * chunks(desc);
}

Status prior_loss(vk::Recorder& recorder, const PriorLossDesc& desc, const PriorLossViews& views,
                  const PriorCounts& counts, double share) {
    SPLAT_TRY(check(recorder, desc, views));
    params::PriorLossParams push = push_of(desc, counts, share);
    const std::uint32_t size = vk::workgroup_size(recorder.device(), kPriorGroup);
    const vk::BufferView slopes = views.workspace.part(0, 16 * pixels(desc));
    const vk::BufferView alignment =
        views.workspace.part(prior_loss_workspace(recorder, desc) - 16, 16);
    const auto record = [&](const char* kernel, std::vector<vk::Access> accesses,
                            std::uint32_t groups) {
        // The alignment sums what chunks of pixels have.
        const double items = groups == 1 ? double{1} * kPriorPlanes * chunks(desc)
                                         : static_cast<double>(pixels(desc));
        vk::Dispatch dispatch;
        dispatch.op = dispatch.shader = kernel;
        dispatch.accesses = std::move(accesses);
        dispatch.groups = vk::groups_for(recorder.device(), groups, 1);
        push.groups_x = dispatch.groups[0];
        dispatch.constants = {{params::kWorkgroupSizeId, size}};
        dispatch.push = push;
        dispatch.work = {.flops = 100 * items, .bytes = 64 * items};
        return recorder.dispatch(dispatch);
    };
    const vk::Access image = vk::read(views.image), extra = vk::read(views.extra);
    const vk::Access map = vk::read(views.map);
    if (!desc.alignment)
        SPLAT_TRY(
            record("prior_loss_sums", {image, extra, map, vk::write(views.partial)}, chunks(desc)));
    SPLAT_TRY(record("prior_loss_align", {vk::read(views.partial), vk::write(alignment)}, 1));
    SPLAT_TRY(record("prior_loss_slopes",
                     {image, extra, map, vk::write(slopes), vk::write(views.partial)},
                     chunks(desc)));
    return record(
        "prior_loss_gradient",
        {image, extra, map, vk::read(slopes), vk::read(alignment), vk::write(views.grad_depth),
         vk::read_write(views.grad_image), vk::write(views.partial)},
        chunks(desc));
}

PriorLosses prior_loss_sums(std::span<const float> partial, const PriorCounts& counts) {
    const std::size_t plane = partial.size() / kPriorPlanes;
    PriorLosses sums;
    for (std::size_t i = 0; i < plane; i += 4) {
        sums.normal += static_cast<double>(partial[2 * plane + i]);
        sums.depth += static_cast<double>(partial[3 * plane + i]);
    }
    return {sums.depth / std::max(counts.depth, 1U), sums.normal / std::max(counts.normal, 1U)};
}

}  // namespace splat::fit
