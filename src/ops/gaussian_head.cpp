#include "ops/gaussian_head.h"

#include <cmath>

#include "params/gaussian_head_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const GaussianHeadDesc& desc,
              const GaussianHeadCameras& cameras, const vk::BufferView& net_out,
              std::vector<vk::Access> rest) {
    SPLAT_TRY(gaussian_head_check(desc));
    const bool focal = cameras.focal.block != nullptr;
    const bool origin = cameras.origin.block != nullptr;
    std::vector<vk::Access> accesses = {
        vk::read(net_out),
        vk::read(cameras.rays),
        vk::read(cameras.view_to_world),
        vk::read(cameras.quaternion),
        vk::read(focal ? cameras.focal : cameras.quaternion),
        vk::read(origin ? cameras.origin : cameras.quaternion),
    };
    accesses.insert(accesses.end(), rest.begin(), rest.end());
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const std::uint64_t gaussians = std::uint64_t{desc.images} * desc.pixels;
    const vk::Groups groups = vk::groups_for(recorder.device(), gaussians, size);
    const double count = static_cast<double>(gaussians);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kGaussianHeadOffsetId, desc.offset ? 1U : 0U},
                      {params::kGaussianHeadDegreeId, desc.sh_degree}},
        .push =
            params::GaussianHeadParams{desc.images, desc.pixels, desc.znear, desc.zfar - desc.znear,
                                       desc.isotropic ? 1U : 0U, desc.activate ? 1U : 0U,
                                       focal ? 1U : 0U, origin ? 1U : 0U, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 150 * count, .bytes = 8.0 * desc.channels * count},
    });
}

}  // namespace

std::uint32_t gaussian_head_channels(const GaussianHeadDesc& desc) {
    return 12 + (desc.offset ? 3U : 0U) + 9 * desc.sh_degree;
}

Status gaussian_head_check(const GaussianHeadDesc& desc) {
    if (desc.sh_degree > 1)
        return error(Code::kInvalidArgument, "gaussian_head: sh_degree is %u, expected 0 or 1",
                     desc.sh_degree);
    if (!std::isfinite(desc.znear) || !std::isfinite(desc.zfar) || desc.znear >= desc.zfar)
        return error(
            Code::kInvalidArgument,
            "gaussian_head: znear is %g and zfar %g, expected finite numbers, znear < zfar",
            static_cast<double>(desc.znear), static_cast<double>(desc.zfar));
    if (desc.views < 1 || desc.images % desc.views != 0)
        return error(Code::kShape,
                     "gaussian_head: %u images do not divide into objects of %u views", desc.images,
                     desc.views);
    if (desc.channels != gaussian_head_channels(desc))
        return error(
            Code::kShape,
            "gaussian_head: net_out has %u channels, expected %u for sh_degree %u %s offset",
            desc.channels, gaussian_head_channels(desc), desc.sh_degree,
            desc.offset ? "with" : "without");
    return {};
}

Status gaussian_head_forward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                             const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                             const GaussianHeadTensors& gaussians) {
    return record(
        recorder, "gaussian_head_forward", desc, cameras, net_out,
        {vk::write(gaussians.means), vk::write(gaussians.opacities), vk::write(gaussians.scales),
         vk::write(gaussians.rotations), vk::write(gaussians.sh)});
}

Status gaussian_head_backward(vk::Recorder& recorder, const GaussianHeadDesc& desc,
                              const vk::BufferView& net_out, const GaussianHeadCameras& cameras,
                              const GaussianHeadTensors& grads,
                              const vk::BufferView& grad_net_out) {
    return record(recorder, "gaussian_head_backward", desc, cameras, net_out,
                  {vk::read(grads.means), vk::read(grads.opacities), vk::read(grads.scales),
                   vk::read(grads.rotations), vk::read(grads.sh), vk::write(grad_net_out)});
}

}  // namespace splat::ops
