#include "nn/executor.h"

#include <algorithm>

#include "core/log.h"
#include "nn/executor_plan.h"
#include "ops/add.h"
#include "ops/quads.h"

namespace splat::nn {
namespace {

constexpr std::size_t kNone = ExecutorPlan::kNone;

/// Row-major to quads where the caller's tensor has memory of its own.
Status pack(vk::Recorder& recorder, const vk::BufferView& port, const vk::BufferView& quads) {
    return port.same_range(quads) ? Status() : ops::quads_pack(recorder, port, quads);
}

Status unpack(vk::Recorder& recorder, const vk::BufferView& quads, const vk::BufferView& port) {
    return port.same_range(quads) ? Status() : ops::quads_unpack(recorder, quads, port);
}

Status record_prepare(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan) {
    for (const auto& call : plan.forward)
        if (plan.keeps(plan.kept_forward, call))
            SPLAT_TRY(graph.nodes()[call.node].row->prepare(
                recorder, graph.nodes()[call.node].attributes, plan.forward_views(call),
                ops::Pass::kForward));
    for (const auto& call : plan.backward)
        if (!call.replay && plan.keeps(plan.kept_backward, call))
            SPLAT_TRY(graph.nodes()[call.node].row->prepare(
                recorder, graph.nodes()[call.node].attributes, plan.backward_views(call),
                ops::Pass::kBackward));
    return {};
}

Status record_forward(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan,
                      const ExecutorPlan::Call& call) {
    const Node& node = graph.nodes()[call.node];
    const ops::OpViews views = plan.forward_views(call);
    if (call.prepared != kNone && !plan.keeps(plan.kept_forward, call))
        SPLAT_TRY(node.row->prepare(recorder, node.attributes, views, ops::Pass::kForward));
    return node.row->forward(recorder, node.attributes, views);
}

/// The calls first ... end - 1 of the backward pass.
Status record_calls(vk::Recorder& recorder, const Graph& graph, const ExecutorPlan& plan,
                    std::size_t first, std::size_t end) {
    for (std::size_t i = first; i < end; ++i) {
        const ExecutorPlan::Call& call = plan.backward[i];
        if (call.replay) {
            SPLAT_TRY(record_forward(recorder, graph, plan, call));
            continue;
        }
        const Node& node = graph.nodes()[call.node];
        const ops::OpViews views = plan.backward_views(call);
        for (const std::size_t tensor : call.zeros) SPLAT_TRY(recorder.fill(plan.view(tensor), 0));
        if (call.prepared != kNone)
            SPLAT_TRY(node.row->prepare(recorder, node.attributes, views, ops::Pass::kBackward));
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

void log_not_kept(const Status& why) {
    log(LogLevel::kInfo, "weights are prepared in every pass: " + why.message());
}

}  // namespace

Executor::Executor(vk::Context& context, const Graph& graph, Parameters& parameters)
    : context_(context), graph_(graph), parameters_(parameters) {}

Executor::~Executor() = default;

Result<std::unique_ptr<Executor>> Executor::create(vk::Context& context, const Graph& graph,
                                                   Parameters& parameters,
                                                   const ExecutorDesc& desc) {
    SPLAT_TRY(graph.status());
    std::unique_ptr<Executor> made(new Executor(context, graph, parameters));
    SPLAT_ASSIGN(std::unique_ptr<ExecutorPlan> plan, made->placed(desc));
    const auto port = [&](std::size_t tensor, ValueId id) {
        vk::BufferView view = plan->view(tensor);
        view.shape = graph.value(id).shape;
        return view;
    };
    for (const auto& [id, tensor] : plan->ports) made->ports_[id] = port(tensor, id);
    for (const auto& [id, tensor] : plan->grad_ports) made->grad_ports_[id] = port(tensor, id);
    made->separate_ = desc.separate;
    if (desc.separate)
        for (const auto& call : plan->forward)
            for (const vk::BufferView& saved : plan->forward_views(call).saved)
                made->saved_.push_back(saved);

    SPLAT_TRY(made->record(*plan, made->prepare_, made->forward_));
    if (!desc.backward) {
        if (plan->has_kept()) made->plan_ = std::move(plan);
        return made;
    }

    SPLAT_TRY(made->record_backward(*plan, desc));
    return made;
}

Status Executor::record_backward(const ExecutorPlan& plan, const ExecutorDesc& desc) {
    const std::vector<std::size_t> ends = plan.cut_backward(desc.backward_parts);
    for (std::size_t part = 0; part < ends.size(); ++part) {
        vk::Recorder recorder(context_);
        if (part == 0)
            for (const ValueId id : desc.grad_outputs)
                SPLAT_TRY(pack(recorder, grad_ports_.at(id), plan.grad_view(id)));
        SPLAT_TRY(record_calls(recorder, graph_, plan, part == 0 ? 0 : ends[part - 1], ends[part]));
        if (part + 1 == ends.size())
            for (const ValueId id : desc.grad_inputs)
                SPLAT_TRY(unpack(recorder, plan.grad_view(id), grad_ports_.at(id)));
        SPLAT_SET(backward_.emplace_back(), recorder.finish());
    }
    parts_.count = static_cast<std::uint32_t>(ends.size());
    for (const std::size_t call : plan.last_calls()) {
        const auto part = call == kNone ? ends.begin() : std::ranges::upper_bound(ends, call);
        parts_.final_in.push_back(static_cast<std::uint32_t>(part - ends.begin()));
    }
    return {};
}

/// The plan, with memory for all tensors; where that is short, nothing is kept for backward passes.
Result<std::unique_ptr<ExecutorPlan>> Executor::placed(ExecutorDesc desc) {
    using Home = ExecutorPlan::Home;
    for (;; desc.keep_prepared = false) {
        auto plan = std::make_unique<ExecutorPlan>(graph_, parameters_, desc);
        SPLAT_TRY(plan->make());
        const bool keeps = desc.backward && plan->has_kept();
        Status placed = plan->place(context_, Home::kArenas, buffers_, memory_);
        if (placed.ok() && keeps) placed = plan->place(context_, Home::kKept, buffers_, memory_);
        if (placed.ok()) return plan;
        buffers_.clear();
        memory_ = {};
        if (!keeps || placed.code() != Code::kOutOfDeviceMemory) return placed;
        log_not_kept(placed);
    }
}

/// The lists that prepare kept parameters, and those of a forward pass.
Status Executor::record(const ExecutorPlan& plan, vk::CommandList& prepare,
                        vk::CommandList& forward) const {
    vk::Recorder recorder(context_);
    SPLAT_TRY(record_prepare(recorder, graph_, plan));
    SPLAT_ASSIGN(prepare, recorder.finish());
    for (const auto& [id, view] : ports_)
        if (graph_.value(id).kind == ValueKind::kInput)
            SPLAT_TRY(pack(recorder, view, plan.value_view(id)));
    for (const auto& call : plan.forward) SPLAT_TRY(record_forward(recorder, graph_, plan, call));
    for (const auto& [id, view] : ports_)
        if (graph_.value(id).kind != ValueKind::kInput)
            SPLAT_TRY(unpack(recorder, plan.value_view(id), view));
    SPLAT_ASSIGN(forward, recorder.finish());
    return {};
}

/// Keep prepared parameters from now on. An error changes nothing.
Status Executor::keep_prepared(ExecutorPlan& plan) {
    std::vector<vk::Buffer> buffers;
    ExecutorMemory memory = memory_;
    SPLAT_TRY(plan.place(context_, ExecutorPlan::Home::kKept, buffers, memory));
    vk::CommandList prepare;
    vk::CommandList forward;
    SPLAT_TRY(record(plan, prepare, forward));
    SPLAT_TRY(context_.make_ready(prepare));
    SPLAT_TRY(context_.make_ready(forward));
    buffers_.insert(buffers_.end(), std::make_move_iterator(buffers.begin()),
                    std::make_move_iterator(buffers.end()));
    prepare_ = std::move(prepare);
    forward_ = std::move(forward);
    const std::lock_guard lock(memory_mutex_);
    memory_ = memory;
    return {};
}

/// What lists were to leave that did not run is not there.
void Executor::forget_dropped() {
    if (!context_.dropped(noted_)) return;
    prepared_revision_ = 0;
    ran_ = false;
}

Status Executor::forward() {
    forget_dropped();
    ran_ = ran_ && separate_;  // otherwise a pass that fails spoils what the one before left
    if (parameters_.outside()->exposed > 0) parameters_.changed();
    const std::uint64_t revision = parameters_.revision();
    if (plan_ != nullptr && ran_revision_ == revision) {
        std::unique_ptr<ExecutorPlan> plan = std::move(plan_);
        const Status kept = keep_prepared(*plan);  // tried once: passes work without
        if (kept.code() == Code::kCancelled) plan_ = std::move(plan);
        if (kept.code() == Code::kCancelled || kept.code() == Code::kDeviceLost) return kept;
        if (!kept.ok()) log_not_kept(kept);
    }
    if (!prepare_.empty() && prepared_revision_ != revision) {
        SPLAT_TRY(context_.run(prepare_));
        prepared_revision_ = revision;
    }
    SPLAT_TRY(context_.run(forward_));
    noted_ = context_.noted();
    ran_revision_ = revision;
    ran_ = true;
    return {};
}

Status Executor::backward(const BetweenParts& between) {
    if (std::ranges::all_of(backward_, &vk::CommandList::empty))
        return bad_state("backward was called on a network made without gradients");
    forget_dropped();
    if (!ran_)
        return bad_state(
            "backward was called without a forward pass of its own: run forward before each");
    if (parameters_.revision() != ran_revision_)
        return bad_state("backward was called after parameters had changed: run forward again");
    ran_ = separate_;
    for (std::uint32_t part = 0; part < parts_.count; ++part) {
        if (part > 0 && between) SPLAT_TRY(between(part - 1));
        SPLAT_TRY(context_.run(backward_[part]));
    }
    return {};
}

}  // namespace splat::nn
