#include "nn/op_rows.h"
#include "ops/activations/relu.h"
#include "ops/max_pool2d.h"

/// What networks of image features have beside convolutions.
namespace splat::nn {
namespace {

Result<OpPlan> relu_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_TRY(ops::quad_dims(inputs[0]).status());
    OpPlan plan;
    plan.outputs = {inputs[0]};
    return plan;
}

Status relu_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::relu_forward(recorder, dims, v.inputs[0], v.outputs[0]);
}

Status relu_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(v.inputs[0].shape));
    return ops::relu_backward(recorder, dims, v.inputs[0], v.grad_outputs[0], v.grad_inputs[0]);
}

Result<ops::MaxPool2dDesc> pool_desc(const Shape& x) {
    if (x.rank() != 4)
        return error(Code::kShape, "max_pool2d: tensor 'x' has shape %s, expected [N, C, H, W]",
                     x.text().c_str());
    const ops::MaxPool2dDesc desc{x[0], x[1], x[2], x[3]};
    SPLAT_TRY(ops::max_pool2d_check(desc));
    return desc;
}

Result<OpPlan> pool_plan(const vk::Recorder&, const Attributes&, std::span<const Shape> inputs) {
    SPLAT_ASSIGN(const ops::MaxPool2dDesc desc, pool_desc(inputs[0]));
    OpPlan plan;
    plan.outputs = {{desc.n, desc.c, desc.height / 2, desc.width / 2}};
    return plan;
}

Status pool_forward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    SPLAT_ASSIGN(const ops::MaxPool2dDesc desc, pool_desc(v.inputs[0].shape));
    return ops::max_pool2d_forward(recorder, desc, v.inputs[0], v.outputs[0]);
}

Status pool_backward(vk::Recorder& recorder, const Attributes&, const OpViews& v) {
    if (!present(v.grad_inputs[0])) return {};
    SPLAT_ASSIGN(const ops::MaxPool2dDesc desc, pool_desc(v.inputs[0].shape));
    return ops::max_pool2d_backward(recorder, desc, v.inputs[0], v.grad_outputs[0],
                                    v.grad_inputs[0]);
}

}  // namespace

const OpRow kReluRow = {.name = "relu",
                        .equation = "y = max(x, 0)",
                        .inputs = kInputX,
                        .outputs = kOutputY,
                        .saved = {},
                        .attributes = {},
                        .plan = relu_plan,
                        .prepare = nullptr,
                        .forward = relu_forward,
                        .backward = relu_backward};

const OpRow kMaxPool2dRow = {.name = "max_pool2d",
                             .equation = "y[i,j] = max of x[2i..2i+1, 2j..2j+1]",
                             .inputs = kInputX,
                             .outputs = kOutputY,
                             .saved = {},
                             .attributes = {},
                             .plan = pool_plan,
                             .prepare = nullptr,
                             .forward = pool_forward,
                             .backward = pool_backward};

}  // namespace splat::nn
