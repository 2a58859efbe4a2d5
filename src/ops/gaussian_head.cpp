#include "ops/gaussian_head.h"

#include <cmath>

#include "ops/launch.h"
#include "params/gaussian_head_params.h"

namespace splat::ops {
namespace {

constexpr std::uint32_t kOffsetId = 10;
constexpr std::uint32_t kDegreeId = 11;

Status record(vk::Recorder& recorder, const char* op, const char* shader,
              const GaussianHeadDesc& desc, std::vector<vk::Access> accesses) {
    const std::uint64_t pixels = std::uint64_t{desc.images} * desc.pixels;
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups = groups_for(recorder.device(), pixels, size);
    params::GaussianHeadParams params{};
    params.images = desc.images;
    params.pixels = desc.pixels;
    params.focals = desc.focals ? 1 : 0;
    params.distances = desc.distances ? 1 : 0;
    params.isotropic = desc.isotropic ? 1 : 0;
    params.activate = desc.activate ? 1 : 0;
    params.sh_transform = desc.sh_transform ? 1 : 0;
    params.znear = desc.znear;
    params.zfar = desc.zfar;
    params.groups_x = groups[0];
    const double items = static_cast<double>(pixels);
    return recorder.dispatch({
        .op = op,
        .shader = shader,
        .constants = {{kWorkgroupSizeId, size},
                      {kOffsetId, desc.offset ? 1U : 0U},
                      {kDegreeId, desc.sh_degree}},
        .push = params,
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 300 * items, .bytes = 200 * items},
    });
}

}  // namespace

std::uint32_t gaussian_head_channels(const GaussianHeadDesc& desc) {
    return 12 + (desc.offset ? 3 : 0) + (desc.sh_degree == 0 ? 0 : 9);
}

Status gaussian_head_check(const GaussianHeadDesc& desc) {
    if (desc.sh_degree > 1)
        return error(Code::kInvalidArgument, "gaussian_head: sh_degree is %u, expected 0 or 1",
                     desc.sh_degree);
    if (!std::isfinite(desc.znear) || !std::isfinite(desc.zfar))
        return error(Code::kInvalidArgument,
                     "gaussian_head: znear %g and zfar %g, expected finite numbers",
                     static_cast<double>(desc.znear), static_cast<double>(desc.zfar));
    return {};
}

Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const GaussianHeadOutputs& outputs) {
    SPLAT_TRY(gaussian_head_check(desc));
    return record(
        recorder, "gaussian_head_forward",
        pick(recorder.kernels(), "gaussian_head_forward", "gaussian_head_forward_cpu"), desc,
        {vk::read(net_out), vk::read(cameras.rays), vk::read(cameras.view_to_world),
         vk::read(cameras.quaternion), vk::read(cameras.focal), vk::read(cameras.distance),
         vk::write(outputs.means), vk::write(outputs.opacities), vk::write(outputs.scales),
         vk::write(outputs.rotations), vk::write(outputs.sh)});
}

Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const GaussianHeadOutputs& grads,
                              const vk::BufferView& grad_net_out) {
    SPLAT_TRY(gaussian_head_check(desc));
    return record(recorder, "gaussian_head_backward",
                  pick(recorder.kernels(), "gaussian_head_backward", "gaussian_head_backward_cpu"),
                  desc,
                  {vk::read(net_out), vk::read(cameras.rays), vk::read(cameras.view_to_world),
                   vk::read(cameras.quaternion), vk::read(cameras.focal), vk::read(grads.means),
                   vk::read(grads.opacities), vk::read(grads.scales), vk::read(grads.rotations),
                   vk::read(grads.sh), vk::write(grad_net_out), vk::read(cameras.distance)});
}

}  // namespace splat::ops
