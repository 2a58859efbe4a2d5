#include "nn/op_rows.h"
#include "ops/activations/silu.h"
#include "ops/add.h"
#include "ops/film.h"
#include "ops/resample2d.h"

namespace splat::nn {
namespace {

using vk::BufferView;

constexpr Port kAddInputs[] = {{"a"}, {"b"}};
constexpr Attribute kAddAttributes[] = {
    {"scale", "number", "1", "multiplies the sum"},
};

Result<ops::AddDesc> add_desc(const Attributes& attributes, const Shape& a) {
    ops::AddDesc desc;
    SPLAT_ASSIGN(desc.x, ops::quad_dims(a));
    desc.scale = static_cast<float>(attributes.number("scale"));
    return desc;
}

Result<OpPlan> add_plan(const vk::Recorder&, const Attributes& attributes,
                        std::span<const Shape> inputs) {
    SPLAT_TRY(add_desc(attributes, inputs[0]).status());
    SPLAT_TRY(expect_shape("add", "b", inputs[1], inputs[0]));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    plan.passes = attributes.number("scale") == 1 ? 0b11 : 0;
    return plan;
}

Status add_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::AddDesc desc, add_desc(attributes, v.inputs[0].shape));
    return ops::add_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status add_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::AddDesc desc, add_desc(attributes, v.inputs[0].shape));
    for (const BufferView& grad : v.grad_inputs)
        if (present(grad)) SPLAT_TRY(ops::add_backward(recorder, desc, v.grad_outputs[0], grad));
    return {};
}

Result<OpPlan> silu_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_TRY(ops::quad_dims(inputs[0]).status());
    OpPlan plan;
    plan.outputs = {inputs[0]};
    return plan;
}

Status silu_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::silu_forward(recorder, dims, v.inputs[0], v.outputs[0]);
}

Status silu_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::silu_backward(recorder, dims, v.inputs[0], v.grad_outputs[0], v.grad_inputs[0]);
}

constexpr Port kResampleInputs[] = {{"x"}, {"filter", Layout::kRowMajor, true, true}};
constexpr Attribute kResampleAttributes[] = {
    {"up", "boolean", "false", "to twice the size; one of up and down"},
    {"down", "boolean", "false", "to half the size"},
};

Result<ops::Resample2dDesc> resample_desc(const Attributes& attributes, const Shape& x,
                                          const Shape& filter) {
    if (x.rank() != 4)
        return error(Code::kShape, "resample2d: tensor 'x' has shape %s, expected [N, C, H, W]",
                     x.text().c_str());
    if (attributes.boolean("up") == attributes.boolean("down"))
        return error(Code::kInvalidArgument,
                     "resample2d: up and down are both %s, expected one of them",
                     attributes.boolean("up") ? "true" : "false");
    if (filter.rank() > 1)
        return error(Code::kShape, "resample2d: tensor 'filter' has shape %s, expected [taps]",
                     filter.text().c_str());
    const std::uint32_t taps = filter.rank() == 1 ? filter[0] : 0;
    return ops::Resample2dDesc{x[0], x[1], x[2], x[3], attributes.boolean("up"), taps};
}

Result<OpPlan> resample_plan(const vk::Recorder&, const Attributes& attributes,
                             std::span<const Shape> inputs) {
    const Shape& x = inputs[0];
    SPLAT_ASSIGN(const ops::Resample2dDesc desc, resample_desc(attributes, x, inputs[1]));
    SPLAT_TRY(ops::resample2d_check(desc));
    OpPlan plan;
    plan.outputs = {desc.up ? Shape{x[0], x[1], 2 * x[2], 2 * x[3]}
                            : Shape{x[0], x[1], x[2] / 2, x[3] / 2}};
    return plan;
}

Status resample_forward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    SPLAT_ASSIGN(const ops::Resample2dDesc desc,
                 resample_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return ops::resample2d_forward(recorder, desc, v.inputs[0],
                                   present(v.inputs[1]) ? v.inputs[1] : v.inputs[0], v.outputs[0]);
}

Status resample_backward(vk::Recorder& recorder, const Attributes& attributes, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::Resample2dDesc desc,
                 resample_desc(attributes, v.inputs[0].shape, v.inputs[1].shape));
    return ops::resample2d_backward(recorder, desc,
                                    present(v.inputs[1]) ? v.inputs[1] : v.grad_outputs[0],
                                    v.grad_outputs[0], v.grad_inputs[0]);
}

constexpr Port kFilmInputs[] = {{"x"}, {"modulation"}};

Result<ops::FilmDesc> film_desc(const Shape& x, const Shape& modulation) {
    ops::FilmDesc desc;
    SPLAT_ASSIGN(desc.x, ops::quad_dims(x));
    const auto [n, c, p] = desc.x;
    desc.scaled = modulation == Shape{n, 2 * c};
    if (!desc.scaled && !(modulation == Shape{n, c}))
        return error(Code::kShape,
                     "film: tensor 'modulation' has shape %s, expected [%u, %u] or "
                     "[%u, %u] for x of shape %s",
                     modulation.text().c_str(), n, 2 * c, n, c, x.text().c_str());
    return desc;
}

Result<OpPlan> film_plan(const vk::Recorder& recorder, const Attributes&,
                         std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::FilmDesc desc, film_desc(inputs[0], inputs[1]));
    SPLAT_TRY(ops::film_check(recorder.device(), desc));
    OpPlan plan;
    plan.outputs = {inputs[0]};
    return plan;
}

Status film_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::FilmDesc desc, film_desc(v.inputs[0].shape, v.inputs[1].shape));
    return ops::film_forward(recorder, desc, v.inputs[0], v.inputs[1], v.outputs[0]);
}

Status film_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::FilmDesc desc, film_desc(v.inputs[0].shape, v.inputs[1].shape));
    if (present(v.grad_inputs[1]))
        SPLAT_TRY(ops::film_backward_modulation(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                                v.grad_inputs[1]));
    if (!present(v.grad_inputs[0])) return {};
    return ops::film_backward_input(recorder, desc, v.inputs[1], v.grad_outputs[0],
                                    v.grad_inputs[0]);
}

}  // namespace

const OpRow kAddRow = {.name = "add",
                       .equation = "y = scale * (a + b)",
                       .inputs = kAddInputs,
                       .outputs = kOutputY,
                       .saved = {},
                       .attributes = kAddAttributes,
                       .plan = add_plan,
                       .prepare = nullptr,
                       .forward = add_forward,
                       .backward = add_backward,
                       .backward_reads = no_backward_reads};

const OpRow kSiluRow = {.name = "silu",
                        .equation = "y = x * sigmoid(x)",
                        .inputs = kInputX,
                        .outputs = kOutputY,
                        .saved = {},
                        .attributes = {},
                        .plan = silu_plan,
                        .prepare = nullptr,
                        .forward = silu_forward,
                        .backward = silu_backward};

const OpRow kResample2dRow = {
    .name = "resample2d",
    .equation = "y = x at twice or half the size, through the filter outer(f, f) / sum(f)^2",
    .inputs = kResampleInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = kResampleAttributes,
    .plan = resample_plan,
    .prepare = nullptr,
    .forward = resample_forward,
    .backward = resample_backward,
    .backward_reads = no_backward_reads};

const OpRow kFilmRow = {
    .name = "film",
    .equation = "y = gamma * x + beta, modulation [N, 2C] = (gamma, beta); [N, C]: y = x + beta",
    .inputs = kFilmInputs,
    .outputs = kOutputY,
    .saved = {},
    .attributes = {},
    .plan = film_plan,
    .prepare = nullptr,
    .forward = film_forward,
    .backward = film_backward,
    .backward_reads = product_backward_reads};

}  // namespace splat::nn
