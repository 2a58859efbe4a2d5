#include "ops/dropout.h"

#include "params/dropout_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const DropoutDesc& desc,
              const vk::BufferView& from, const vk::BufferView& counter, const vk::BufferView& to) {
    SPLAT_TRY(dropout_check(desc));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), desc.x.quads(), size);
    const double bytes = static_cast<double>(desc.x.bytes());
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::DropoutParams{static_cast<std::uint32_t>(desc.x.quads()), desc.stream,
                                      dropout_threshold(desc.p),
                                      static_cast<float>(1 / (1 - desc.p)), groups[0]},
        .accesses = {vk::read(from), vk::read(counter), vk::write(to)},
        .groups = groups,
        .work = {.flops = 5 * bytes, .bytes = 2 * bytes},
        .may_alias = true,
    });
}

}  // namespace

Status dropout_check(const DropoutDesc& desc) {
    if (!(desc.p >= 0 && desc.p < 1))
        return error(Code::kInvalidArgument, "dropout: p is %g, expected 0 <= p < 1", desc.p);
    return {};
}

std::uint32_t dropout_threshold(double p) {
    return static_cast<std::uint32_t>(p * 0x1p32);
}

Status dropout_forward(vk::Recorder& recorder, const DropoutDesc& desc, const vk::BufferView& x,
                       const vk::BufferView& counter, const vk::BufferView& y) {
    return record(recorder, "dropout_forward", desc, x, counter, y);
}

Status dropout_backward(vk::Recorder& recorder, const DropoutDesc& desc,
                        const vk::BufferView& counter, const vk::BufferView& grad_y,
                        const vk::BufferView& grad_x) {
    return record(recorder, "dropout_backward", desc, grad_y, counter, grad_x);
}

}  // namespace splat::ops
