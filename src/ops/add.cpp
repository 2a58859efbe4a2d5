#include "ops/add.h"

#include "params/add_params.h"

namespace splat::ops {
namespace {

Status record(vk::Recorder& recorder, const char* kernel, const AddDesc& desc,
              std::vector<vk::Access> accesses) {
    const double bytes = static_cast<double>(desc.x.bytes());
    const double tensors = static_cast<double>(accesses.size());
    return record_each(recorder,
                       {.kernel = kernel,
                        .items = desc.x.quads(),
                        .accesses = std::move(accesses),
                        .work = {.flops = bytes / 2, .bytes = tensors * bytes},
                        .may_alias = true},
                       [&](std::uint32_t groups_x) {
                           return params::AddParams{static_cast<std::uint32_t>(desc.x.quads()),
                                                    desc.scale, groups_x};
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

namespace {

constexpr Port kAddInputs[] = {{"a"}, {"b"}};
constexpr Attribute kAddAttributes[] = {
    {"scale", "number", "1", "multiplies the sum"},
};

Result<AddDesc> add_desc(const Attributes& attributes, const Shape& a) {
    SPLAT_ASSIGN(const QuadDims x, quad_dims(a));
    return AddDesc{x, static_cast<float>(attributes.number("scale"))};
}

Result<OpPlan> add_plan(const vk::Recorder&, const Attributes& attributes,
                        std::span<const Shape> inputs) {
    SPLAT_TRY(quad_dims(inputs[0]).status());
    SPLAT_TRY(expect_shape("add", "b", inputs[1], inputs[0]));
    return OpPlan{.outputs = {inputs[0]}, .passes = attributes.number("scale") == 1 ? 0b11U : 0U};
}

Status add_row_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const AddDesc desc, add_desc(attributes, v.inputs[0].shape));
    return add_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status add_row_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const AddDesc desc, add_desc(attributes, v.inputs[0].shape));
    for (const vk::BufferView& grad : v.grad_inputs)
        if (present(grad)) SPLAT_TRY(add_backward(recorder, desc, v.grad_outputs[0], grad));
    return {};
}

}  // namespace

const OpRow kAddRow = {.name = "add",
                       .equation = "y = scale * (a + b)",
                       .inputs = kAddInputs,
                       .outputs = kOutputY,
                       .attributes = kAddAttributes,
                       .plan = add_plan,
                       .forward = add_row_forward,
                       .backward = add_row_backward,
                       .backward_reads = no_backward_reads};

}  // namespace splat::ops
