#include "model/graph_reference.h"

#include <cmath>
#include <string_view>

#include "ref/op_ref.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

using nn::kNoValue;
using nn::ValueId;

/// [N, C, ...] in another shape of the same quads: the pixels of all images are one row, channels stay.
std::vector<double> reshaped(const std::vector<double>& from, const Shape& shape, const Shape& to) {
    const std::size_t c = shape[1];
    const std::size_t pixels = from.size() / (shape[0] * c);
    const std::size_t to_pixels = from.size() / (to[0] * c);
    std::vector<double> result(from.size());
    for (std::size_t column = 0; column < from.size() / c; ++column)
        for (std::size_t k = 0; k < c; ++k)
            result[(column / to_pixels * c + k) * to_pixels + column % to_pixels] =
                from[(column / pixels * c + k) * pixels + column % pixels];
    return result;
}

double attribute(const ops::Attributes& attributes, const ops::Attribute& of) {
    const std::string_view type = of.type;
    if (type == "boolean") return attributes.boolean(of.name) ? 1 : 0;
    if (type == "integer") return static_cast<double>(attributes.integer(of.name));
    return attributes.number(of.name);
}

/// Inputs and attributes of a node.
ref::OpArguments arguments(GraphReference& reference, const nn::Graph& graph,
                           const nn::Node& node) {
    ref::OpArguments in;
    for (const ValueId id : node.inputs) {
        in.inputs.emplace_back();
        if (id == kNoValue) continue;
        const Shape& shape = graph.value(id).shape;
        for (std::uint32_t axis = 0; axis < shape.rank(); ++axis)
            in.inputs.back().dims.push_back(shape[axis]);
        in.inputs.back().values = reference.value(id);
    }
    for (const ops::Attribute& of : node.row->attributes)
        in.attributes[of.name] = attribute(node.attributes, of);
    return in;
}

}  // namespace

const std::vector<double>& GraphReference::value(ValueId id) {
    const nn::Value& of = graph_.value(id);
    if (of.base != kNoValue) {  // a view of it
        const nn::Value& base = graph_.value(of.base);
        const std::vector<double>& from = value(of.base);
        values_[id] =
            of.layout == ops::Layout::kQuads ? reshaped(from, base.shape, of.shape) : from;
    }
    return values_.at(id);
}

const std::vector<double>& GraphReference::gradient(ValueId id) {
    std::vector<double>& grad = gradients_[id];
    grad.resize(graph_.value(id).shape.elements(), 0);
    return grad;
}

void GraphReference::add_gradient(ValueId id, const std::vector<double>& grad) {
    const nn::Value& of = graph_.value(id);
    if (of.base != kNoValue) {
        const Shape& shape = graph_.value(of.base).shape;
        add_gradient(of.base,
                     of.layout == ops::Layout::kQuads ? reshaped(grad, of.shape, shape) : grad);
        return;
    }
    std::vector<double>& sum = gradients_[id];
    sum.resize(grad.size(), 0);
    for (std::size_t i = 0; i < grad.size(); ++i) sum[i] += grad[i];
}

void GraphReference::forward() {
    gradients_.clear();
    for (const nn::Node& node : graph_.nodes()) {
        const ref::OpRef* op = ref::find_op(node.row->name);
        ASSERT_NE(op, nullptr) << node.row->name;
        const ref::Sums outputs = op->forward(arguments(*this, graph_, node));
        for (std::size_t i = 0; i < outputs.size(); ++i)
            values_[node.outputs[i]] = outputs[i].value;
    }
}

void GraphReference::backward(ValueId id, const std::vector<double>& grad) {
    add_gradient(id, grad);
    for (auto node = graph_.nodes().rbegin(); node != graph_.nodes().rend(); ++node) {
        std::vector<ref::Values> grads;
        for (const ValueId output : node->outputs) grads.push_back(gradient(output));
        const ref::Sums inputs =
            ref::find_op(node->row->name)->backward(arguments(*this, graph_, *node), grads);
        for (std::size_t i = 0; i < inputs.size(); ++i)
            if (node->inputs[i] != kNoValue && !inputs[i].value.empty())
                add_gradient(node->inputs[i], inputs[i].value);
    }
}

Result<std::unique_ptr<GraphRun>> GraphRun::create(vk::Context& context, const nn::Graph& graph,
                                                   ValueId output,
                                                   const std::vector<ValueId>& grad_inputs) {
    std::unique_ptr<GraphRun> made(new GraphRun(context, graph, output));
    SPLAT_ASSIGN(nn::Parameters parameters, nn::Parameters::create(context, graph));
    made->parameters_ = std::make_unique<nn::Parameters>(std::move(parameters));
    nn::ExecutorDesc desc;
    desc.outputs = desc.grad_outputs = {output};
    desc.backward = true;
    desc.grad_inputs = grad_inputs;
    SPLAT_ASSIGN(made->executor_, nn::Executor::create(context, graph, *made->parameters_, desc));
    return made;
}

Status GraphRun::put(ValueId id, const std::vector<float>& values) {
    if (graph_.value(id).kind == nn::ValueKind::kParameter)
        return parameters_->write(parameters_->of(id), values);
    return context_.write(executor_->tensor(id), values.data(), values.size() * 4);
}

Status GraphRun::read(const vk::BufferView& view, std::vector<float>& values) const {
    values.resize(view.shape.elements());
    return context_.read(view, values.data(), values.size() * 4);
}

Status GraphRun::run(const std::vector<float>& grad_output) {
    SPLAT_TRY(parameters_->zero_gradients());
    SPLAT_TRY(executor_->forward());
    SPLAT_TRY(read(executor_->tensor(output_), output_values_));
    SPLAT_TRY(
        context_.write(executor_->gradient(output_), grad_output.data(), grad_output.size() * 4));
    return executor_->backward();
}

std::vector<float> GraphRun::gradient(ValueId id) const {
    std::vector<float> values;
    const bool parameter = graph_.value(id).kind == nn::ValueKind::kParameter;
    EXPECT_OK(read(parameter ? parameters_->of(id).grad : executor_->gradient(id), values));
    return values;
}

double norm_of(const std::vector<double>& values) {
    double sum = 0;
    for (const double value : values) sum += value * value;
    return std::sqrt(sum);
}

}  // namespace splat::test
