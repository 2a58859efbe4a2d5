#include "nn/op_instance.h"

namespace splat::nn {

using ops::present;
using vk::BufferView;

Result<std::unique_ptr<OpInstance>> OpInstance::create(vk::Context& context, const ops::OpRow& row,
                                                       std::span<const JsonScalar> attributes,
                                                       const Tensors& tensors) {
    std::unique_ptr<OpInstance> op(new OpInstance(context, row));
    ExecutorDesc desc;
    desc.separate = true;
    desc.overwrite = !tensors.accumulate;
    desc.label = row.name;
    std::vector<ValueId> inputs(row.inputs.size(), kNoValue);
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        if (!present(tensors.inputs[i])) continue;
        inputs[i] =
            op->graph_.input(row.inputs[i].name, tensors.inputs[i].shape, row.inputs[i].layout);
        desc.tensors[inputs[i]] = tensors.inputs[i];
    }
    desc.outputs = op->graph_.node(row.name, inputs, {attributes.begin(), attributes.end()});
    SPLAT_TRY(op->graph_.status());
    SPLAT_TRY(op->check_shapes(tensors));
    for (std::size_t i = 0; i < desc.outputs.size(); ++i)
        desc.tensors[desc.outputs[i]] = tensors.outputs[i];

    op->has_backward_ = !tensors.grad_outputs.empty();
    for (std::size_t i = 0; i < tensors.grad_inputs.size(); ++i) {
        if (!present(tensors.grad_inputs[i])) continue;
        desc.grad_inputs.push_back(inputs[i]);
        desc.gradients[inputs[i]] = tensors.grad_inputs[i];
    }
    op->wants_gradients_ = op->has_backward_ && !desc.grad_inputs.empty();
    if (op->wants_gradients_) {
        desc.backward = true;
        desc.grad_outputs = desc.outputs;
        for (std::size_t i = 0; i < desc.outputs.size(); ++i)
            desc.gradients[desc.outputs[i]] = tensors.grad_outputs[i];
    }
    SPLAT_ASSIGN(op->parameters_, Parameters::create(context, op->graph_));
    SPLAT_ASSIGN(op->executor_, Executor::create(context, op->graph_, *op->parameters_, desc));
    return op;
}

Status OpInstance::check_shapes(const Tensors& tensors) const {
    const ops::OpPlan& plan = graph_.nodes()[0].plan;
    const auto check = [this](const char* prefix, const char* name, const Shape& got,
                              const Shape& expected) {
        return ops::expect_shape(row_.name, (std::string(prefix) + name).c_str(), got, expected);
    };
    for (std::size_t i = 0; i < row_.outputs.size(); ++i) {
        SPLAT_TRY(check("", row_.outputs[i].name, tensors.outputs[i].shape, plan.outputs[i]));
        if (!tensors.grad_outputs.empty())
            SPLAT_TRY(check("grad_", row_.outputs[i].name, tensors.grad_outputs[i].shape,
                            plan.outputs[i]));
    }
    for (std::size_t i = 0; i < tensors.grad_inputs.size(); ++i)
        if (present(tensors.grad_inputs[i]) && !present(tensors.inputs[i]))
            return invalid("%s: tensor 'grad_%s' is given, but '%s' is not", row_.name,
                           row_.inputs[i].name, row_.inputs[i].name);
        else if (present(tensors.grad_inputs[i]) && row_.inputs[i].constant)
            return invalid("%s: tensor 'grad_%s' is given, but '%s' has no gradient", row_.name,
                           row_.inputs[i].name, row_.inputs[i].name);
        else if (present(tensors.grad_inputs[i]))
            SPLAT_TRY(check("grad_", row_.inputs[i].name, tensors.grad_inputs[i].shape,
                            tensors.inputs[i].shape));
    return {};
}

Status OpInstance::forward() {
    SPLAT_TRY(executor_->forward());
    ran_ = true;
    return {};
}

Status OpInstance::backward() {
    if (!has_backward_)
        return bad_state("%s: backward was called, but the operator was made without grad_outputs",
                         row_.name);
    if (!ran_) return bad_state("%s: backward was called before the first forward", row_.name);
    return wants_gradients_ ? executor_->backward() : Status();
}

}  // namespace splat::nn
