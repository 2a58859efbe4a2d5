#include "ops/activations/activation.h"

#include "ops/launch.h"
#include "params/activation_params.h"

namespace splat::ops {

Status record_activation(vk::Recorder& recorder, const char* op, const char* shader,
                         const QuadDims& dims, std::vector<vk::Access> accesses, double flops) {
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups = groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return recorder.dispatch({
        .op = op,
        .shader = shader,
        .constants = {{kWorkgroupSizeId, size}},
        .push = params::ActivationParams{static_cast<std::uint32_t>(dims.quads()), groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = flops * bytes / 4, .bytes = tensors * bytes},
        .may_alias = true,
    });
}

}  // namespace splat::ops
