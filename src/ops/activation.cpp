#include "ops/activation.h"

#include "params/activation_params.h"
#include "vk/launch.h"

namespace splat::ops {

Status record_activation(vk::Recorder& recorder, const char* kernel, const QuadDims& dims,
                         std::vector<vk::Access> accesses, double flops) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::ActivationParams{static_cast<std::uint32_t>(dims.quads()), groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = flops * bytes / 4, .bytes = tensors * bytes},
        .may_alias = true,
    });
}

}  // namespace splat::ops
