#include "ops/split3.h"

#include "params/split3_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record_split3(vk::Recorder& recorder, const char* kernel, const QuadDims& dims,
                     std::vector<vk::Access> accesses) {
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), dims.quads(), size);
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::Split3Params{dims.n * dims.p, dims.c, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 0, .bytes = 6 * static_cast<double>(dims.bytes())},
    });
}

}  // namespace

Status split3_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                      const vk::BufferView& a, const vk::BufferView& b, const vk::BufferView& c) {
    return record_split3(recorder, "split3_forward", dims,
                         {vk::read(x), vk::write(a), vk::write(b), vk::write(c)});
}

Status split3_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& grad_a,
                       const vk::BufferView& grad_b, const vk::BufferView& grad_c,
                       const vk::BufferView& grad_x) {
    return record_split3(recorder, "split3_backward", dims,
                         {vk::read(grad_a), vk::read(grad_b), vk::read(grad_c), vk::write(grad_x)});
}

}  // namespace splat::ops
