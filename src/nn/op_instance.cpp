#include "nn/op_instance.h"

#include <algorithm>

#include "ops/quads.h"

namespace splat::nn {
namespace {

using vk::BufferView;

}  // namespace

Result<std::unique_ptr<OpInstance>> OpInstance::create(vk::Context& context, const ops::OpRow& row,
                                                       std::span<const JsonScalar> attributes,
                                                       const Tensors& tensors) {
    std::unique_ptr<OpInstance> op(new OpInstance(context, row));
    SPLAT_ASSIGN(const ops::Attributes complete, ops::complete_attributes(row, attributes));
    std::vector<Shape> shapes;
    for (std::size_t i = 0; i < row.inputs.size(); ++i) {
        const BufferView& input = tensors.inputs[i];
        if (ops::present(input) && input.shape.rank() == 0)  // to a plan, rank 0 means absent
            return error(Code::kShape,
                         "%s: tensor '%s' has shape [], expected at least one dimension", row.name,
                         row.inputs[i].name);
        shapes.push_back(input.shape);
    }
    const vk::Recorder recorder(context);
    SPLAT_ASSIGN(const ops::OpPlan plan, row.plan(recorder, complete, shapes));
    SPLAT_TRY(op->check_shapes(plan, tensors));
    SPLAT_TRY(op->allocate(plan, tensors));
    SPLAT_TRY(op->record(complete, tensors));
    return op;
}

Status OpInstance::check_shapes(const ops::OpPlan& plan, const Tensors& tensors) const {
    const auto check = [this](const char* prefix, const char* name, const Shape& got,
                              const Shape& expected) -> Status {
        if (got == expected) return {};
        return error(Code::kShape, "%s: tensor '%s%s' has shape %s, expected %s", row_.name, prefix,
                     name, got.text().c_str(), expected.text().c_str());
    };
    for (std::size_t i = 0; i < row_.outputs.size(); ++i) {
        SPLAT_TRY(check("", row_.outputs[i].name, tensors.outputs[i].shape, plan.outputs[i]));
        if (!tensors.grad_outputs.empty())
            SPLAT_TRY(check("grad_", row_.outputs[i].name, tensors.grad_outputs[i].shape,
                            plan.outputs[i]));
    }
    for (std::size_t i = 0; i < tensors.grad_inputs.size(); ++i)
        if (ops::present(tensors.grad_inputs[i]) && row_.inputs[i].constant)
            return error(Code::kInvalidArgument,
                         "%s: tensor 'grad_%s' is given, but '%s' has no gradient", row_.name,
                         row_.inputs[i].name, row_.inputs[i].name);
        else if (ops::present(tensors.grad_inputs[i]))
            SPLAT_TRY(check("grad_", row_.inputs[i].name, tensors.grad_inputs[i].shape,
                            tensors.inputs[i].shape));
    return {};
}

Result<BufferView> OpInstance::scratch(const Shape& shape, ops::Layout layout) {
    std::uint64_t bytes = vk::quad_bytes(shape.elements());
    if (layout == ops::Layout::kQuads) {
        SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(shape));
        bytes = dims.bytes();
    }
    SPLAT_ASSIGN(vk::Buffer buffer,
                 context_.memory().allocate(bytes, vk::MemoryKind::kDevice, row_.name));
    buffers_.push_back(std::move(buffer));
    BufferView view = buffers_.back().range();
    view.shape = shape;
    return view;
}

/// The tensor itself if the operator takes it as it is, else scratch in the operator's layout.
Result<BufferView> OpInstance::on_device(const BufferView& tensor, ops::Layout layout) {
    if (layout == ops::Layout::kRowMajor) return tensor;
    return scratch(tensor.shape, layout);
}

Status OpInstance::allocate(const ops::OpPlan& plan, const Tensors& tensors) {
    for (std::size_t i = 0; i < row_.inputs.size(); ++i) {
        BufferView view;
        if (ops::present(tensors.inputs[i])) {
            SPLAT_ASSIGN(view, on_device(tensors.inputs[i], row_.inputs[i].layout));
        }
        views_.inputs.push_back(view);
    }
    for (std::size_t i = 0; i < row_.outputs.size(); ++i) {
        SPLAT_ASSIGN(const BufferView view, on_device(tensors.outputs[i], row_.outputs[i].layout));
        views_.outputs.push_back(view);
    }
    for (const Shape& shape : plan.saved) {
        SPLAT_ASSIGN(const BufferView view, scratch(shape, ops::Layout::kRowMajor));
        views_.saved.push_back(view);
    }
    std::uint64_t workspace = plan.forward_workspace;
    if (!tensors.grad_outputs.empty()) {
        workspace = std::max(workspace, plan.backward_workspace);
        for (std::size_t i = 0; i < row_.outputs.size(); ++i) {
            SPLAT_ASSIGN(const BufferView view,
                         on_device(tensors.grad_outputs[i], row_.outputs[i].layout));
            views_.grad_outputs.push_back(view);
        }
        for (std::size_t i = 0; i < row_.inputs.size(); ++i) {
            BufferView view;
            if (ops::present(tensors.grad_inputs[i])) {
                SPLAT_ASSIGN(view, on_device(tensors.grad_inputs[i], row_.inputs[i].layout));
            }
            views_.grad_inputs.push_back(view);
        }
    }
    const auto reserve = [this](std::uint64_t bytes, BufferView& view) -> Status {
        if (bytes == 0) return {};
        SPLAT_ASSIGN(vk::Buffer buffer,
                     context_.memory().allocate(bytes, vk::MemoryKind::kDevice, row_.name));
        view = buffer.range();
        buffers_.push_back(std::move(buffer));
        return {};
    };
    SPLAT_TRY(reserve(workspace, views_.workspace));
    SPLAT_TRY(reserve(plan.forward_prepared, views_.forward_prepared));
    if (!tensors.grad_outputs.empty())
        SPLAT_TRY(reserve(plan.backward_prepared, views_.backward_prepared));
    views_.accumulate = tensors.accumulate;
    return {};
}

Status OpInstance::record(const ops::Attributes& attributes, const Tensors& tensors) {
    vk::Recorder recorder(context_);
    for (std::size_t i = 0; i < row_.inputs.size(); ++i)
        if (row_.inputs[i].layout == ops::Layout::kQuads && ops::present(tensors.inputs[i]))
            SPLAT_TRY(ops::quads_pack(recorder, tensors.inputs[i], views_.inputs[i]));
    if (row_.prepare != nullptr)
        SPLAT_TRY(row_.prepare(recorder, attributes, views_, ops::Pass::kForward));
    SPLAT_TRY(row_.forward(recorder, attributes, views_));
    for (std::size_t i = 0; i < row_.outputs.size(); ++i)
        if (row_.outputs[i].layout == ops::Layout::kQuads)
            SPLAT_TRY(ops::quads_unpack(recorder, views_.outputs[i], tensors.outputs[i]));
    SPLAT_ASSIGN(forward_, recorder.finish());
    if (tensors.grad_outputs.empty()) return {};
    has_backward_ = true;

    for (std::size_t i = 0; i < row_.outputs.size(); ++i)
        if (row_.outputs[i].layout == ops::Layout::kQuads)
            SPLAT_TRY(ops::quads_pack(recorder, tensors.grad_outputs[i], views_.grad_outputs[i]));
    if (row_.prepare != nullptr)
        SPLAT_TRY(row_.prepare(recorder, attributes, views_, ops::Pass::kBackward));
    std::vector<bool> wanted;
    for (const BufferView& grad : views_.grad_inputs) wanted.push_back(ops::present(grad));
    ops::OpViews views = views_;
    ops::drop_unread(row_, wanted, views);
    SPLAT_TRY(row_.backward(recorder, attributes, views));
    for (std::size_t i = 0; i < row_.inputs.size(); ++i)
        if (row_.inputs[i].layout == ops::Layout::kQuads && ops::present(tensors.grad_inputs[i]))
            SPLAT_TRY(ops::quads_unpack(recorder, views_.grad_inputs[i], tensors.grad_inputs[i]));
    SPLAT_ASSIGN(backward_, recorder.finish());
    return {};
}

Status OpInstance::forward() {
    SPLAT_TRY(context_.run(forward_));
    ran_ = true;
    return {};
}

Status OpInstance::backward() {
    if (!has_backward_)
        return error(Code::kInvalidState,
                     "%s: backward was called, but the operator was made without grad_outputs",
                     row_.name);
    if (!ran_)
        return error(Code::kInvalidState, "%s: backward was called before the first forward",
                     row_.name);
    if (backward_.empty()) return {};  // no gradient is wanted
    return context_.run(backward_);
}

}  // namespace splat::nn
