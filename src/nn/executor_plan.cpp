#include "nn/executor_plan.h"

#include <algorithm>

#include "ops/quads.h"

namespace splat::nn {
namespace {

constexpr std::uint32_t kForever = ~std::uint32_t{0};

vk::BufferView shaped(vk::BufferView view, const Shape& shape) {
    view.shape = shape;
    return view;
}

}  // namespace

std::size_t ExecutorPlan::tensor(std::string name, std::uint64_t bytes, std::uint32_t first) {
    tensors_.push_back({{first, clock_, bytes}, std::move(name), {}, Home::kArenas, first});
    return tensors_.size() - 1;
}

std::size_t ExecutorPlan::prepared(const Node& node, std::uint64_t bytes) {
    const std::size_t made = tensor(node.row->name, bytes, clock_);
    tensors_[made].earliest = backward_begin_;
    return made;
}

/// From the first command to the last.
void ExecutorPlan::keep(std::size_t tensor) {
    tensors_[tensor].life.first = 0;
    tensors_[tensor].life.last = kForever;
}

/// The tensor that the caller sees of a value in `own`: the same unless only that is in quads.
std::size_t ExecutorPlan::port(ValueId id, std::size_t own,
                               const std::map<ValueId, vk::BufferView>& given) {
    const Value& value = graph_.value(id);
    const std::size_t port =
        value.layout == ops::Layout::kQuads && !desc_.quads.contains(id)
            ? tensor(value.name, vk::quad_bytes(value.shape.elements()), clock_)
            : own;
    keep(port);
    if (const auto found = given.find(id); found != given.end()) {
        tensors_[port].home = Home::kGiven;
        tensors_[port].view = found->second;
    }
    return port;
}

Result<std::uint64_t> ExecutorPlan::bytes_of(ValueId id) const {
    const Value& value = graph_.value(id);
    if (value.layout == ops::Layout::kRowMajor) return vk::quad_bytes(value.shape.elements());
    SPLAT_ASSIGN(const ops::QuadDims dims, ops::quad_dims(value.shape, 1));
    return dims.bytes();
}

Status ExecutorPlan::make() {
    const std::size_t count = graph_.values().size();
    values_.assign(count, kNone);
    grads_.assign(count, kNone);
    saved_.resize(graph_.nodes().size());
    kept_forward.assign(graph_.nodes().size(), kNone);
    kept_backward.assign(graph_.nodes().size(), kNone);
    SPLAT_TRY(find_wanted());
    if (desc_.backward) SPLAT_TRY(find_reached());
    find_crossing();
    SPLAT_TRY(plan_inputs());
    SPLAT_TRY(plan_forward());
    SPLAT_TRY(plan_outputs());
    if (desc_.backward) SPLAT_TRY(plan_backward());
    ++clock_;
    for (std::size_t i = 0; desc_.separate && i < tensors_.size(); ++i) keep(i);
    for (Tensor& tensor : tensors_) tensor.life.last = std::min(tensor.life.last, clock_);
    return {};
}

Status ExecutorPlan::find_wanted() {
    wanted_.assign(graph_.values().size(), false);
    reached_.assign(graph_.values().size(), false);
    if (!desc_.backward) return {};
    for (std::size_t id = 0; id < wanted_.size(); ++id)
        wanted_[graph_.root(static_cast<ValueId>(id))] =
            wanted_[graph_.root(static_cast<ValueId>(id))] || graph_.values()[id].trainable;
    for (const ValueId id : desc_.grad_inputs) wanted_[graph_.root(id)] = true;
    for (const Node& node : graph_.nodes())
        for (std::size_t i = 0; i < node.inputs.size(); ++i) {
            if (node.inputs[i] == kNoValue || node.row->inputs[i].constant) continue;
            if (!wanted_[graph_.root(node.inputs[i])]) continue;
            for (const ValueId output : node.outputs) wanted_[graph_.root(output)] = true;
        }
    return {};
}

Status ExecutorPlan::find_reached() {
    for (const ValueId id : desc_.grad_outputs) {
        if (std::find(desc_.outputs.begin(), desc_.outputs.end(), id) == desc_.outputs.end() ||
            !wanted_[graph_.root(id)])
            return invalid(
                "the gradient of '%s' is given, but it is not an output or depends on nothing "
                "that is trained",
                graph_.value(id).name.c_str());
        reached_[graph_.root(id)] = true;
    }
    for (std::size_t node = graph_.nodes().size(); node-- > 0;) {
        const Node& n = graph_.nodes()[node];
        const bool reached = std::any_of(n.outputs.begin(), n.outputs.end(), [&](ValueId output) {
            return reached_[graph_.root(output)];
        });
        if (!reached) continue;
        const std::vector<bool> wanted = wanted_inputs(node);
        for (std::size_t i = 0; i < wanted.size(); ++i)
            if (wanted[i]) reached_[graph_.root(n.inputs[i])] = true;
    }
    return {};
}

bool ExecutorPlan::runs_backward(std::size_t node, const std::vector<bool>& wanted) const {
    const Node& n = graph_.nodes()[node];
    const auto is_reached = [&](ValueId id) { return reached_[graph_.root(id)]; };
    return std::any_of(n.outputs.begin(), n.outputs.end(), is_reached) &&
           std::find(wanted.begin(), wanted.end(), true) != wanted.end();
}

std::vector<bool> ExecutorPlan::wanted_inputs(std::size_t node) const {
    const Node& n = graph_.nodes()[node];
    std::vector<bool> wanted(n.inputs.size(), false);
    for (std::size_t i = 0; i < wanted.size(); ++i)
        wanted[i] = n.inputs[i] != kNoValue && !n.row->inputs[i].constant &&
                    wanted_[graph_.root(n.inputs[i])];
    return wanted;
}

bool ExecutorPlan::keeps_prepared(const Node& node) const {
    if (!desc_.keep_prepared) return false;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
        if (node.inputs[i] == kNoValue || node.row->inputs[i].layout != ops::Layout::kRowMajor)
            continue;
        const Value& value = graph_.value(graph_.root(node.inputs[i]));
        if (value.kind != ValueKind::kParameter || (desc_.backward && value.trainable))
            return false;
    }
    return true;
}

/// Keep prepared parameters up to `most` bytes in all. Without a backward pass there is also room for a
/// pass that keeps nothing.
void ExecutorPlan::plan_prepared(Call& call, std::uint64_t bytes, std::uint64_t most,
                                 std::size_t& kept) {
    const Node& n = graph_.nodes()[call.node];
    const bool keeps = keeps_prepared(n) && kept_bytes_ + bytes <= most;
    if (!keeps || !desc_.backward) call.prepared = prepared(n, bytes);
    if (!keeps) return;
    kept = tensor(n.row->name, bytes, clock_);
    tensors_[kept].home = Home::kKept;
    keep(kept);
    kept_bytes_ += bytes;
}

Status ExecutorPlan::plan_inputs() {
    for (std::size_t i = 0; i < graph_.values().size(); ++i) {
        const auto id = static_cast<ValueId>(i);
        const Value& value = graph_.value(id);
        if (value.base != kNoValue || value.kind != ValueKind::kInput) continue;
        SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(id));
        values_[id] = tensor(value.name, bytes, clock_);
        ports[id] = port(id, values_[id], desc_.tensors);
    }
    return {};
}

Status ExecutorPlan::plan_forward() {
    for (std::size_t node = 0; node < graph_.nodes().size(); ++node) {
        ++clock_;
        const Node& n = graph_.nodes()[node];
        Call call;
        call.node = node;
        SPLAT_TRY(plan_results(call));
        for (std::size_t i = 0; i < n.outputs.size(); ++i) values_[n.outputs[i]] = call.outputs[i];
        saved_[node] = call.saved;
        if (n.plan.forward_prepared > 0)
            plan_prepared(call, n.plan.forward_prepared, UINT64_MAX, kept_forward[node]);
        forward.push_back(std::move(call));
    }
    return {};
}

/// Inputs, new tensors for the results, and the workspace of a node's forward pass.
Status ExecutorPlan::plan_results(Call& call) {
    const Node& n = graph_.nodes()[call.node];
    for (const ValueId input : n.inputs) {
        call.inputs.push_back(input == kNoValue ? kNone : values_[graph_.root(input)]);
        if (call.inputs.back() != kNone) touch(call.inputs.back());
    }
    for (const ValueId output : n.outputs) {
        SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(output));
        call.outputs.push_back(tensor(graph_.value(output).name, bytes, clock_));
    }
    for (std::size_t i = 0; i < n.plan.saved.size(); ++i)
        call.saved.push_back(
            tensor(n.row->saved[i], vk::quad_bytes(n.plan.saved[i].elements()), clock_));
    if (n.plan.forward_workspace > 0)
        call.workspace = tensor(n.row->name, n.plan.forward_workspace, clock_);
    return {};
}

Status ExecutorPlan::plan_outputs() {
    ++clock_;
    for (const ValueId id : desc_.outputs) {
        touch(values_[graph_.root(id)]);
        ports[id] = port(id, values_[graph_.root(id)], desc_.tensors);
    }
    return {};
}

Status ExecutorPlan::plan_backward() {
    backward_begin_ = ++clock_;
    for (const ValueId id : desc_.grad_outputs) {
        const Value& value = graph_.value(id);
        const ValueId root = graph_.root(id);
        if (grads_[root] != kNone)
            return invalid("the gradient of '%s' is given twice", value.name.c_str());
        SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(root));
        grads_[root] = tensor(value.name, bytes, clock_);
        grad_ports[id] = port(id, grads_[root], desc_.gradients);
    }
    for (const ValueId id : desc_.grad_inputs) {
        const Value& value = graph_.value(id);
        const ValueId root = graph_.root(id);
        if (!reached_[root])
            return invalid("the gradient of '%s' is requested, but no output depends on it",
                           value.name.c_str());
        if (!desc_.quads.contains(id) || !desc_.gradients.contains(id)) continue;
        SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(root));
        grads_[root] = tensor(value.name, bytes, clock_);  // the sum begins with the caller's
        port(id, grads_[root], desc_.gradients);
    }
    const std::vector<Node>& nodes = graph_.nodes();
    for (std::size_t node = nodes.size(); node-- > 0;) {
        // The last segment's values are fresh from the forward pass.
        const std::uint32_t segment = nodes[node].segment;
        if (desc_.recompute && segment != nodes.back().segment &&
            segment != nodes[node + 1].segment) {
            std::size_t first = node;
            while (first > 0 && nodes[first - 1].segment == segment) --first;
            SPLAT_TRY(plan_replay(first, node));
        }
        ++clock_;
        SPLAT_TRY(plan_backward_node(node));
    }
    ++clock_;
    for (const ValueId id : desc_.grad_inputs) {
        const ValueId root = graph_.root(id);
        touch(grads_[root]);
        grad_ports[id] = port(id, grads_[root], desc_.gradients);
    }
    return {};
}

Status ExecutorPlan::plan_backward_node(std::size_t node) {
    const Node& n = graph_.nodes()[node];
    const std::vector<bool> wanted = wanted_inputs(node);
    if (!runs_backward(node, wanted)) return {};
    Call call;
    call.node = node;
    for (const ValueId output : n.outputs) call.outputs.push_back(values_[output]);
    call.saved = saved_[node];
    for (const ValueId output : n.outputs) {
        std::size_t& grad = grads_[output];
        if (grad == kNone) {  // no gradient reaches this output
            SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(output));
            grad = tensor(graph_.value(output).name, bytes, clock_);
            call.zeros.push_back(grad);
        }
        touch(grad);
        call.grad_outputs.push_back(grad);
    }
    bool activation = false;
    for (std::size_t i = 0; i < n.inputs.size(); ++i) {
        if (n.inputs[i] == kNoValue) {
            call.inputs.push_back(kNone);
            call.grad_inputs.push_back(kNone);
            continue;
        }
        const std::size_t value = values_[graph_.root(n.inputs[i])];
        call.inputs.push_back(value);
        if (value != kNone && ops::backward_reads(*n.row, i, wanted)) touch(value);
        if (wanted[i]) {
            SPLAT_TRY(plan_grad_input(call, i));
            activation = activation || n.row->inputs[i].layout == ops::Layout::kQuads;
        } else {
            call.grad_inputs.push_back(kNone);
        }
    }
    for (const std::size_t saved : saved_[node]) touch(saved);
    if (n.plan.backward_workspace > 0) {
        call.workspace = tensor(n.row->name, n.plan.backward_workspace, clock_);
        tensors_[call.workspace].least = n.plan.backward_least;
    }
    if (n.plan.backward_prepared > 0 && activation)
        plan_prepared(call, n.plan.backward_prepared, desc_.kept_bytes, kept_backward[node]);
    backward.push_back(std::move(call));
    return {};
}

/// If an input's gradient equals the output's, reuse that tensor, which has no later reader, or add it to
/// the existing sum.
bool ExecutorPlan::pass_gradient(Call& call, std::size_t input) {
    const Node& n = graph_.nodes()[call.node];
    const ValueId root = graph_.root(n.inputs[input]);
    if (desc_.separate || (n.plan.passes >> input & 1) == 0 ||
        graph_.value(root).kind == ValueKind::kParameter)
        return false;
    const std::size_t grad = call.grad_outputs[0];
    if (grads_[root] == kNone) {
        if (call.passed) return false;
        call.passed = true;
        grads_[root] = grad;
    } else {
        call.sums.emplace_back(grad, grads_[root]);
    }
    touch(grads_[root]);
    call.grad_inputs.push_back(kNone);
    return true;
}

Status ExecutorPlan::plan_grad_input(Call& call, std::size_t input) {
    const ValueId id = graph_.nodes()[call.node].inputs[input];
    const ValueId root = graph_.root(id);
    const Value& value = graph_.value(root);
    SPLAT_ASSIGN(const std::uint64_t bytes, bytes_of(root));
    if (pass_gradient(call, input)) return {};
    const bool first = grads_[root] == kNone;
    if (first) {
        grads_[root] = tensor(value.name, bytes, clock_);
        if (value.kind == ValueKind::kParameter) {
            tensors_[grads_[root]].home = Home::kGiven;
            SPLAT_ASSERT(parameters_.of(root).grad.block != nullptr);
            tensors_[grads_[root]].view = parameters_.of(root).grad;
        } else if (value.layout == ops::Layout::kRowMajor && !desc_.gradients.contains(root)) {
            call.zeros.push_back(grads_[root]);  // row-major gradients are summed in place
        }
    }
    touch(grads_[root]);
    if (first || value.layout == ops::Layout::kRowMajor) {
        call.grad_inputs.push_back(grads_[root]);
        return {};
    }
    const std::size_t part = tensor(value.name, bytes, clock_);
    call.grad_inputs.push_back(part);
    const bool given =
        tensors_[grads_[root]].home == Home::kGiven ||
        std::any_of(desc_.grad_outputs.begin(), desc_.grad_outputs.end(), [&](ValueId output) {
            return graph_.root(output) == root;
        });  // the caller's is written there
    if (input == 0 && graph_.nodes()[call.node].plan.adds && !given) {
        call.addend = grads_[root];
        grads_[root] = part;
        return {};
    }
    call.sums.emplace_back(part, grads_[root]);
    return {};
}

vk::BufferView ExecutorPlan::value_view(ValueId id) const {
    const Value& value = graph_.value(id);
    if (value.kind == ValueKind::kParameter) return shaped(parameters_.of(id).value, value.shape);
    return shaped(tensors_[values_[graph_.root(id)]].view, value.shape);
}

vk::BufferView ExecutorPlan::grad_view(ValueId id) const {
    return shaped(tensors_[grads_[graph_.root(id)]].view, graph_.value(id).shape);
}

ops::OpViews ExecutorPlan::views(const Call& call) const {
    const Node& node = graph_.nodes()[call.node];
    ops::OpViews v;
    for (std::size_t i = 0; i < node.inputs.size(); ++i) {
        const ValueId input = node.inputs[i];
        v.inputs.push_back(input == kNoValue ? vk::BufferView{}
                           : call.inputs[i] == kNone
                               ? value_view(input)
                               : shaped(tensors_[call.inputs[i]].view, graph_.value(input).shape));
    }
    for (std::size_t i = 0; i < node.outputs.size(); ++i)
        v.outputs.push_back(
            shaped(tensors_[call.outputs[i]].view, graph_.value(node.outputs[i]).shape));
    for (std::size_t i = 0; i < call.saved.size(); ++i)
        v.saved.push_back(shaped(tensors_[call.saved[i]].view, node.plan.saved[i]));
    if (call.workspace != kNone) v.workspace = tensors_[call.workspace].view;
    v.accumulate = !desc_.overwrite;
    return v;
}

ops::OpViews ExecutorPlan::forward_views(const Call& call) const {
    ops::OpViews v = views(call);
    const std::size_t prepared =
        keeps(kept_forward, call) ? kept_forward[call.node] : call.prepared;
    if (prepared != kNone) v.forward_prepared = tensors_[prepared].view;
    return v;
}

ops::OpViews ExecutorPlan::backward_views(const Call& call) const {
    const Node& node = graph_.nodes()[call.node];
    ops::OpViews v = views(call);
    ops::drop_unread(*node.row, wanted_inputs(call.node), v);
    const std::size_t prepared =
        keeps(kept_backward, call) ? kept_backward[call.node] : call.prepared;
    if (prepared != kNone) v.backward_prepared = tensors_[prepared].view;
    if (call.addend != kNone) v.addend = tensors_[call.addend].view;
    for (std::size_t i = 0; i < node.outputs.size(); ++i)
        v.grad_outputs.push_back(
            shaped(tensors_[call.grad_outputs[i]].view, graph_.value(node.outputs[i]).shape));
    for (std::size_t i = 0; i < node.inputs.size(); ++i)
        v.grad_inputs.push_back(
            call.grad_inputs[i] == kNone
                ? vk::BufferView{}
                : shaped(tensors_[call.grad_inputs[i]].view, graph_.value(node.inputs[i]).shape));
    return v;
}

}  // namespace splat::nn
