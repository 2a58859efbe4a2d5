#include "nn/executor.h"

#include "nn/executor_plan.h"
#include "nn/op_rows.h"
#include "ops/add.h"
#include "ops/quads.h"

namespace splat::nn {
namespace {

constexpr std::size_t kNone = ExecutorPlan::kNone;

/// Row-major to quads where the value is an activation; otherwise they are the same memory.
Status pack(vk::Recorder& recorder, const Value& value, const vk::BufferView& port,
            const vk::BufferView& quads) {
    return value.layout == Layout::kQuads ? ops::quads_pack(recorder, port, quads) : Status();
}

Status unpack(vk::Recorder& recorder, const Value& value, const vk::BufferView& quads,
              const vk::BufferView& port) {
    return value.layout == Layout::kQuads ? ops::quads_unpack(recorder, quads, port) : Status();
}

Status record_prepare(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan) {
    for (const auto& call : plan.forward)
        if (plan.kept_forward[call.node] != kNone)
            SPLAT_TRY(
                graph.nodes()[call.node].row->prepare(recorder, graph.nodes()[call.node].attributes,
                                                      plan.forward_views(call), Pass::kForward));
    for (const auto& call : plan.backward)
        if (plan.kept_backward[call.node] != kNone)
            SPLAT_TRY(
                graph.nodes()[call.node].row->prepare(recorder, graph.nodes()[call.node].attributes,
                                                      plan.backward_views(call), Pass::kBackward));
    return {};
}

Status record_forward(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan) {
    for (const auto& call : plan.forward) {
        const Node& node = graph.nodes()[call.node];
        const OpViews views = plan.forward_views(call);
        if (call.prepared != kNone)
            SPLAT_TRY(node.row->prepare(recorder, node.attributes, views, Pass::kForward));
        SPLAT_TRY(node.row->forward(recorder, node.attributes, views));
    }
    return {};
}

Status record_backward(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan) {
    for (const auto& call : plan.backward) {
        const Node& node = graph.nodes()[call.node];
        const OpViews views = plan.backward_views(call);
        for (const std::size_t tensor : call.zeros) SPLAT_TRY(recorder.fill(plan.view(tensor), 0));
        if (call.prepared != kNone)
            SPLAT_TRY(node.row->prepare(recorder, node.attributes, views, Pass::kBackward));
        SPLAT_TRY(node.row->backward(recorder, node.attributes, views));
        for (const auto& [part, sum] : call.sums) {
            vk::BufferView a = plan.view(sum);
            vk::BufferView b = plan.view(part);
            a.shape = b.shape = {static_cast<std::uint32_t>(a.bytes / 16), 4};
            SPLAT_TRY(ops::add_forward(recorder, {ops::quad_dims(a.shape).value(), 1.0F}, a, b, a));
        }
    }
    return {};
}

}  // namespace

Result<std::unique_ptr<Executor>> Executor::create(vk::Context& context, const Graph& graph,
                                                   Parameters& parameters,
                                                   const ExecutorDesc& desc) {
    SPLAT_TRY(graph.status());
    std::unique_ptr<Executor> made(new Executor(context, graph, parameters));
    vk::Recorder recorder(context);
    ExecutorPlan plan(recorder, graph, parameters, desc);
    SPLAT_TRY(plan.make());
    SPLAT_TRY(plan.place(context, made->buffers_, made->memory_));
    const auto port = [&](std::size_t tensor, ValueId id) {
        vk::BufferView view = plan.view(tensor);
        view.shape = graph.value(id).shape;
        return view;
    };
    for (const auto& [id, tensor] : plan.ports) made->ports_[id] = port(tensor, id);
    for (const auto& [id, tensor] : plan.grad_ports) made->grad_ports_[id] = port(tensor, id);

    SPLAT_TRY(record_prepare(recorder, graph, plan));
    SPLAT_ASSIGN(made->prepare_, recorder.finish());

    for (const auto& [id, view] : made->ports_)
        if (graph.value(id).kind == ValueKind::kInput)
            SPLAT_TRY(pack(recorder, graph.value(id), view, plan.value_view(id)));
    SPLAT_TRY(record_forward(recorder, graph, plan));
    for (const ValueId id : desc.outputs)
        SPLAT_TRY(unpack(recorder, graph.value(id), plan.value_view(id), made->ports_.at(id)));
    SPLAT_ASSIGN(made->forward_, recorder.finish());
    if (!desc.backward) return made;

    for (const ValueId id : desc.grad_outputs)
        SPLAT_TRY(pack(recorder, graph.value(id), made->grad_ports_.at(id), plan.grad_view(id)));
    SPLAT_TRY(record_backward(recorder, graph, plan));
    for (const ValueId id : desc.grad_inputs)
        SPLAT_TRY(unpack(recorder, graph.value(id), plan.grad_view(id), made->grad_ports_.at(id)));
    SPLAT_ASSIGN(made->backward_, recorder.finish());
    return made;
}

Status Executor::prepare() {
    if (prepared_revision_ == parameters_.revision()) return {};
    if (!prepare_.empty()) SPLAT_TRY(context_.run(prepare_));
    prepared_revision_ = parameters_.revision();
    return {};
}

Status Executor::forward() {
    SPLAT_TRY(prepare());
    SPLAT_TRY(context_.run(forward_));
    ran_ = true;
    return {};
}

Status Executor::backward() {
    if (backward_.empty())
        return error(Code::kInvalidState,
                     "backward was called on a network made without gradients");
    if (!ran_)
        return error(Code::kInvalidState,
                     "backward was called without a forward pass of its own: each takes one");
    ran_ = false;
    return context_.run(backward_);
}

}  // namespace splat::nn
