#include "nn/graph.h"

#include "core/checked_math.h"
#include "nn/memory_plan.h"

#include "ops/quads.h"

namespace splat::nn {

ValueId Graph::add(Value value) {
    values_.push_back(std::move(value));
    return static_cast<ValueId>(values_.size() - 1);
}

void Graph::fail(Status status) {
    if (status_.ok()) status_ = std::move(status);
}

ValueId Graph::input(std::string name, const Shape& shape, ops::Layout layout) {
    return add({std::move(name), ValueKind::kInput, shape, layout, false, kNoValue});
}

ValueId Graph::parameter(std::string name, const Shape& shape, bool trainable) {
    if (find(name) != kNoValue)
        fail(invalid("the network has two parameters named '%s'", name.c_str()));
    return add({std::move(name), ValueKind::kParameter, shape, ops::Layout::kRowMajor, trainable,
                kNoValue});
}

Result<Node> Graph::make_node(const ops::OpRow& row, std::vector<ValueId> inputs,
                              std::span<const JsonScalar> attributes) {
    SPLAT_ASSIGN(ops::Attributes complete, ops::complete_attributes(row, attributes));
    inputs.resize(row.inputs.size(), kNoValue);
    std::vector<Shape> shapes;
    for (std::size_t i = 0; i < inputs.size(); ++i) {
        const ops::Port& port = row.inputs[i];
        if (inputs[i] == kNoValue) {
            if (!port.optional)
                return error(Code::kShape, "%s: tensor '%s' is absent", row.name, port.name);
            shapes.emplace_back();
            continue;
        }
        const Value& value = values_[inputs[i]];
        if (value.layout != port.layout)
            return error(Code::kShape, "%s: tensor '%s' is %s, expected %s", row.name, port.name,
                         value.layout == ops::Layout::kQuads ? "an activation" : "row-major",
                         port.layout == ops::Layout::kQuads ? "an activation" : "row-major");
        if (value.shape.rank() == 0)  // to a plan, rank 0 means absent
            return error(Code::kShape,
                         "%s: tensor '%s' has shape [], expected at least one dimension", row.name,
                         port.name);
        shapes.push_back(value.shape);
    }
    SPLAT_ASSIGN(ops::OpPlan plan, row.plan(recorder_, complete, shapes));
    return Node{&row, std::move(complete), std::move(inputs), {}, std::move(plan), segment_};
}

std::vector<ValueId> Graph::node(const char* op, std::vector<ValueId> inputs,
                                 std::vector<JsonScalar> attributes) {
    const Result<const ops::OpRow*> row = ops::find_op(op);
    if (row.ok()) return node(*row.value(), std::move(inputs), std::move(attributes));
    fail(row.status());
    return {kNoValue};
}

std::vector<ValueId> Graph::node(const ops::OpRow& row, std::vector<ValueId> inputs,
                                 std::vector<JsonScalar> attributes) {
    const std::vector<ValueId> none(row.outputs.size(), kNoValue);
    if (!status_.ok()) return none;
    Result<Node> made = make_node(row, std::move(inputs), attributes);
    if (!made.ok()) {
        fail(made.status());
        return none;
    }
    Node node = std::move(made.value());
    for (std::size_t i = 0; i < node.plan.outputs.size(); ++i)
        node.outputs.push_back(
            add({std::string(row.name) + "." + row.outputs[i].name, ValueKind::kActivation,
                 node.plan.outputs[i], row.outputs[i].layout, false, kNoValue}));
    nodes_.push_back(std::move(node));
    return nodes_.back().outputs;
}

ValueId Graph::op(const char* op, std::vector<ValueId> inputs, std::vector<JsonScalar> attributes) {
    return node(op, std::move(inputs), std::move(attributes))[0];
}

ValueId Graph::reshape(ValueId value, const Shape& shape) {
    if (!status_.ok()) return kNoValue;
    const Value from = values_[value];
    bool same = from.shape.elements() == shape.elements();
    if (from.layout == ops::Layout::kQuads)
        same = same && shape.rank() >= 2 && from.shape[1] == shape[1];
    if (!same) {
        fail(error(Code::kShape, "reshape: '%s' has shape %s, which does not fit %s",
                   from.name.c_str(), from.shape.text().c_str(), shape.text().c_str()));
        return kNoValue;
    }
    return add({from.name, from.kind, shape, from.layout, false, root(value)});
}

ValueId Graph::root(ValueId id) const {
    return values_[id].base == kNoValue ? id : values_[id].base;
}

ValueId Graph::find(std::string_view name) const {
    for (std::size_t i = 0; i < values_.size(); ++i)
        if (values_[i].kind != ValueKind::kActivation && values_[i].base == kNoValue &&
            values_[i].name == name)
            return static_cast<ValueId>(i);
    return kNoValue;
}

Graph::Bytes Graph::forward_bytes() const {
    const auto end = static_cast<std::uint32_t>(nodes_.size());
    std::vector<std::uint32_t> first(values_.size(), 0), last(values_.size(), end);
    for (std::uint32_t at = end; at-- > 0;) {  // the first mention from behind is the last
        for (const ValueId id : nodes_[at].inputs)
            if (id != kNoValue && last[root(id)] == end) last[root(id)] = at;
        for (const ValueId id : nodes_[at].outputs) first[root(id)] = at;
    }
    Bytes bytes;
    std::vector<Lifetime> lives;
    for (ValueId id = 0; id < values_.size(); ++id) {
        const Value& value = values_[id];
        if (value.base != kNoValue) continue;
        const bool quads = value.layout == ops::Layout::kQuads && value.shape.rank() > 1;
        const std::uint64_t channels = quads ? value.shape[1] : 1;
        const std::uint64_t size =
            vk::quad_bytes(value.shape.elements() / channels * (quads ? round_up(channels, 4) : 1));
        if (value.kind == ValueKind::kParameter)
            bytes.parameters += size;
        else if (value.kind == ValueKind::kInput)
            lives.push_back({0, end, size});
        else
            lives.push_back({first[id], last[id], size});
    }
    for (std::uint32_t at = 0; at < end; ++at) {
        const ops::OpPlan& plan = nodes_[at].plan;
        std::uint64_t own = plan.forward_workspace + plan.forward_prepared;
        for (const Shape& saved : plan.saved) own += vk::quad_bytes(saved.elements());
        lives.push_back({at, at, own});
        bytes.prepared += plan.forward_prepared;
    }
    bytes.pass = peak_bytes(lives);
    return bytes;
}

}  // namespace splat::nn
