// ExecutorDesc::recompute: values that a segment's backward pass reads are recomputed just before it.
#include <algorithm>

#include "nn/executor_plan.h"

namespace splat::nn {

void ExecutorPlan::find_crossing() {
    constexpr std::uint32_t kNowhere = ~std::uint32_t{0};
    std::vector<std::uint32_t> home(graph_.values().size(), kNowhere);  // inputs, parameters
    for (const Node& node : graph_.nodes())
        for (const ValueId output : node.outputs) home[output] = node.segment;
    crosses_.assign(home.size(), false);
    for (const ValueId id : desc_.outputs) crosses_[graph_.root(id)] = true;
    for (const Node& node : graph_.nodes())
        for (const ValueId input : node.inputs)
            if (input != kNoValue && home[graph_.root(input)] != node.segment)
                crosses_[graph_.root(input)] = true;
}

/// Recompute values of the nodes first to last that only these nodes read and that their backward passes
/// need.
Status ExecutorPlan::plan_replay(std::size_t first, std::size_t last) {
    std::vector<bool> needed(values_.size(), false);  // by root value
    std::vector<bool> again(last - first + 1, false);
    for (std::size_t node = last + 1; node-- > first;) {
        const Node& n = graph_.nodes()[node];
        const bool replayed = std::any_of(n.outputs.begin(), n.outputs.end(),
                                          [&](ValueId output) { return needed[output]; });
        const std::vector<bool> wanted = wanted_inputs(node);
        const bool runs = runs_backward(node, wanted);
        for (std::size_t i = 0; i < n.inputs.size(); ++i) {
            if (n.inputs[i] == kNoValue) continue;
            const ValueId root = graph_.root(n.inputs[i]);
            const bool read = replayed || (runs && ops::backward_reads(*n.row, i, wanted));
            if (read && !crosses_[root]) needed[root] = true;
        }
        again[node - first] = replayed;
    }
    for (std::size_t node = first; node <= last; ++node) {
        if (!again[node - first]) continue;
        ++clock_;
        const Node& n = graph_.nodes()[node];
        Call call;
        call.node = node;
        call.replay = true;
        SPLAT_TRY(plan_results(call));
        for (std::size_t i = 0; i < n.outputs.size(); ++i)
            if (!crosses_[n.outputs[i]]) values_[n.outputs[i]] = call.outputs[i];
        saved_[node] = call.saved;
        if (n.plan.forward_prepared > 0 && kept_forward[node] == kNone)
            call.prepared = prepared(n, n.plan.forward_prepared);
        backward.push_back(std::move(call));
    }
    return {};
}

}  // namespace splat::nn
