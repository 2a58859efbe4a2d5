#include "ops/relu.h"

#include "ops/launch.h"
#include "params/relu_params.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* op, const char* shader, const QuadDims& dims,
              std::vector<vk::Access> accesses) {
    const std::uint32_t size = workgroup_size(recorder.device(), 64);
    const vk::Groups groups = groups_for(recorder.device(), dims.quads(), size);
    const double bytes = static_cast<double>(dims.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return recorder.dispatch({
        .op = op,
        .shader = shader,
        .constants = {{kWorkgroupSizeId, size}},
        .push = params::ReluParams{static_cast<std::uint32_t>(dims.quads()), groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 0.25 * bytes, .bytes = tensors * bytes},
        .may_alias = true,
    });
}

}  // namespace

Status relu_forward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                    const vk::BufferView& y) {
    return record(recorder, "relu_forward",
                  pick(recorder.kernels(), "relu_forward", "relu_forward_cpu"), dims,
                  {vk::read(x), vk::write(y)});
}

Status relu_backward(vk::Recorder& recorder, const QuadDims& dims, const vk::BufferView& x,
                     const vk::BufferView& grad_y, const vk::BufferView& grad_x) {
    return record(recorder, "relu_backward",
                  pick(recorder.kernels(), "relu_backward", "relu_backward_cpu"), dims,
                  {vk::read(x), vk::read(grad_y), vk::write(grad_x)});
}

}  // namespace splat::ops
