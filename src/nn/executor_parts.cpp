// ExecutorDesc::backward_parts: where the backward pass is cut.
#include <algorithm>

#include "nn/executor_plan.h"

namespace splat::nn {

std::vector<std::size_t> ExecutorPlan::last_calls() const {
    std::vector<std::size_t> last(parameters_.all().size(), kNone);
    for (std::size_t i = 0; i < backward.size(); ++i) {
        const Call& call = backward[i];
        for (std::size_t input = 0; input < call.grad_inputs.size(); ++input) {
            if (call.grad_inputs[input] == kNone) continue;
            const ValueId root = graph_.root(graph_.nodes()[call.node].inputs[input]);
            if (graph_.value(root).kind == ValueKind::kParameter)
                last[static_cast<std::size_t>(&parameters_.of(root) - parameters_.all().data())] =
                    i;
        }
    }
    return last;
}

std::vector<std::size_t> ExecutorPlan::cut_backward(std::uint32_t parts) const {
    const std::size_t calls = backward.size();
    if (parts <= 1 || calls == 0) return {calls};
    // Both shares are in numbers of calls times elements.
    std::vector<std::uint64_t> weights(calls, 0);
    std::uint64_t elements = 0;
    const std::vector<std::size_t> last = last_calls();
    for (std::size_t i = 0; i < last.size(); ++i) {
        if (last[i] == kNone) continue;
        const std::uint64_t own = parameters_.all()[i].shape.elements();
        weights[last[i]] += own * calls;
        elements += own;
    }
    std::vector<std::size_t> ends;
    elements = std::max<std::uint64_t>(elements, 1);
    const std::uint64_t all = 2 * elements * calls;
    std::uint64_t sum = 0, next = 1;
    for (std::size_t i = 0; i + 1 < calls; ++i) {
        sum += weights[i] + elements;
        if (sum * parts < next * all) continue;
        ends.push_back(i + 1);
        next = sum * parts / all + 1;
    }
    ends.push_back(calls);
    return ends;
}

}  // namespace splat::nn
