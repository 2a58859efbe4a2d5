#include "ops/max_pool2d.h"

#include "params/max_pool2d_params.h"
#include "vk/launch.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const MaxPool2dDesc& desc,
              std::uint64_t invocations, std::vector<vk::Access> accesses) {
    SPLAT_TRY(max_pool2d_check(desc));
    const std::uint32_t planes = (desc.c + 3) / 4 * desc.n;
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), planes * invocations, size);
    const double quads = static_cast<double>(planes) * desc.height * desc.width;
    const double gradient = accesses.size() > 2 ? 2 : 1;
    return recorder.dispatch({
        .op = kernel,
        .shader = kernel,
        .constants = {{params::kWorkgroupSizeId, size}},
        .push = params::MaxPool2dParams{planes, desc.height, desc.width, groups[0]},
        .accesses = std::move(accesses),
        .groups = groups,
        .work = {.flops = 3 * quads, .bytes = 16 * (gradient + 0.25) * quads},
    });
}

}  // namespace

Status max_pool2d_check(const MaxPool2dDesc& desc) {
    if (desc.height >= 2 && desc.width >= 2) return {};
    return error(Code::kShape, "max_pool2d: an image of %u x %u, expected at least 2 x 2",
                 desc.height, desc.width);
}

Status max_pool2d_forward(vk::Recorder& recorder, const MaxPool2dDesc& desc,
                          const vk::BufferView& x, const vk::BufferView& y) {
    return record(recorder, "max_pool2d_forward", desc,
                  std::uint64_t{desc.height / 2} * (desc.width / 2), {vk::read(x), vk::write(y)});
}

Status max_pool2d_backward(vk::Recorder& recorder, const MaxPool2dDesc& desc,
                           const vk::BufferView& x, const vk::BufferView& grad_y,
                           const vk::BufferView& grad_x) {
    return record(recorder, "max_pool2d_backward", desc, std::uint64_t{desc.height} * desc.width,
                  {vk::read(x), vk::read(grad_y), vk::write(grad_x)});
}

namespace {

Result<MaxPool2dDesc> max_pool2d_desc(const Shape& x) {
    if (x.rank() != 4)
        return error(Code::kShape, "max_pool2d: tensor 'x' has shape %s, expected [N, C, H, W]",
                     x.text().c_str());
    return MaxPool2dDesc{x[0], x[1], x[2], x[3]};
}

Result<OpPlan> max_pool2d_plan(const vk::Recorder&, const Attributes&,
                               std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const MaxPool2dDesc desc, max_pool2d_desc(inputs[0]));
    SPLAT_TRY(max_pool2d_check(desc));
    return OpPlan{.outputs = {Shape{desc.n, desc.c, desc.height / 2, desc.width / 2}}};
}

Status max_pool2d_row_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const MaxPool2dDesc desc, max_pool2d_desc(v.inputs[0].shape));
    return max_pool2d_forward(recorder, desc, v.inputs[0], v.outputs[0]);
}

Status max_pool2d_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const MaxPool2dDesc desc, max_pool2d_desc(v.inputs[0].shape));
    return max_pool2d_backward(recorder, desc, v.inputs[0], v.grad_outputs[0], v.grad_inputs[0]);
}

}  // namespace

const OpRow kMaxPool2dRow = {.name = "max_pool2d",
                             .equation = "y[i,j] = max of x[2i..2i+1, 2j..2j+1]",
                             .inputs = kInputX,
                             .outputs = kOutputY,
                             .plan = max_pool2d_plan,
                             .forward = max_pool2d_row_forward,
                             .backward = max_pool2d_row_backward};

}  // namespace splat::ops
