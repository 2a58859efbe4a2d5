#include "gaussians/plane_loss.h"

#include "params/loss_params.h"
#include "vk/launch.h"

namespace splat::gaussians {
namespace {

/// A pass with a workgroup for each plane, of which one may have all Gaussians.
Status per_plane(vk::Recorder& recorder, const char* shader, const SetViews& set,
                 const PlaneViews& planes, float scale, std::span<const vk::Access> more) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64, planes.gaussians);
    const vk::Groups groups = vk::groups_for(recorder.device(), planes.planes, 1);
    const double count = planes.gaussians;
    const vk::Work work{.flops = 100 * count, .bytes = 100 * count};
    vk::Dispatch dispatch{
        .op = shader,
        .shader = shader,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::PlaneLossParams{planes.planes, scale, groups[0]},
        .accesses = {vk::read(set.gaussians), vk::read(planes.members), vk::read(planes.begins),
                     vk::read(planes.normals)},
        .groups = groups,
        .work = work,
        .most_group = work,
    };
    dispatch.accesses.insert(dispatch.accesses.end(), more.begin(), more.end());
    return recorder.dispatch(dispatch);
}

}  // namespace

Status plane_loss_forward(vk::Recorder& recorder, const SetViews& set, const PlaneViews& planes,
                          const vk::BufferView& loss) {
    const vk::Access made[] = {vk::write(planes.offsets), vk::write(planes.partial)};
    SPLAT_TRY(per_plane(recorder, "plane_loss_forward", set, planes, 0, made));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64, planes.planes);
    return recorder.dispatch({
        .op = "loss_sum",
        .shader = "loss_sum",
        .constants = {{params::kWorkgroupSizeId, size}},
        .push =
            params::LossParams{0, 0, planes.planes, 1.0F / static_cast<float>(planes.gaussians), 1},
        .accesses = {vk::read(planes.partial), vk::write(loss)},
        .work = {.flops = static_cast<double>(planes.planes), .bytes = 4.0 * planes.planes},
    });
}

Status plane_loss_backward(vk::Recorder& recorder, const SetViews& set, const PlaneViews& planes,
                           const vk::BufferView& grad_loss, const SetViews& grad) {
    const vk::Access used[] = {vk::read(planes.offsets), vk::read(grad_loss),
                               vk::read_write(grad.gaussians)};
    return per_plane(recorder, "plane_loss_backward", set, planes,
                     1.0F / static_cast<float>(planes.gaussians), used);
}

}  // namespace splat::gaussians
