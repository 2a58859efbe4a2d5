#include "ops/add.h"

#include "params/add_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const AddDesc& desc,
              std::vector<vk::Access> accesses) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), desc.x.quads(), size);
    const double bytes = static_cast<double>(desc.x.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push =
            params::AddParams{static_cast<std::uint32_t>(desc.x.quads()), desc.scale, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = bytes / 2, .bytes = tensors * bytes},
        .may_alias = true,
    });
}

}  // namespace

Status add_forward(vk::Recorder& recorder, const AddDesc& desc, const vk::BufferView& a,
                   const vk::BufferView& b, const vk::BufferView& y) {
    return record(recorder, "add_forward", desc, {vk::read(a), vk::read(b), vk::write(y)});
}

Status add_backward(vk::Recorder& recorder, const AddDesc& desc, const vk::BufferView& grad_y,
                    const vk::BufferView& grad_x) {
    return record(recorder, "add_backward", desc, {vk::read(grad_y), vk::write(grad_x)});
}

}  // namespace splat::ops
