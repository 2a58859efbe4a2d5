#include "ops/images/max_pool2d.h"

#include "params/images_params.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const MaxPool2dDesc& desc,
              std::uint64_t invocations, std::vector<vk::Access> accesses) {
    SPLAT_TRY(max_pool2d_check(desc));
    const std::uint32_t planes = (desc.c + 3) / 4 * desc.n;
    const double quads = static_cast<double>(planes) * desc.height * desc.width;
    const double gradient = accesses.size() > 2 ? 2 : 1;
    return record_each(
        recorder,
        {.kernel = kernel,
         .items = planes * invocations,
         .accesses = std::move(accesses),
         .work = {.flops = 3 * quads, .bytes = 16 * (gradient + 0.25) * quads}},
        [&](std::uint32_t groups_x) {
            return params::MaxPool2dParams{planes, desc.height, desc.width, groups_x};
        });
}

}  // namespace

Status max_pool2d_check(const MaxPool2dDesc& desc) {
    if (desc.height >= 2 && desc.width >= 2) return {};
    return error(Code::kShape, "max_pool2d: an image of %u x %u, expected at least 2 x 2",
                 desc.height, desc.width);
}

namespace {

Result<MaxPool2dDesc> max_pool2d_desc(const Shape& x) {
    SPLAT_TRY(expect_images("max_pool2d", "x", x));
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
    return record(recorder, "max_pool2d_forward", desc,
                  std::uint64_t{desc.height / 2} * (desc.width / 2),
                  {vk::read(v.inputs[0]), vk::write(v.outputs[0])});
}

Status max_pool2d_row_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const MaxPool2dDesc desc, max_pool2d_desc(v.inputs[0].shape));
    return record(
        recorder, "max_pool2d_backward", desc, std::uint64_t{desc.height} * desc.width,
        {vk::read(v.inputs[0]), vk::read(v.grad_outputs[0]), vk::write(v.grad_inputs[0])});
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
