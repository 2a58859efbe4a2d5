#pragma once

#include <algorithm>
#include <map>
#include <vector>

#include "nn/executor.h"

namespace splat::nn {

/// The plan that Executor::create makes before recording: which gradients to compute, and all tensors of
/// a step with their lifetimes on a clock that ticks once per node and pass.
class ExecutorPlan {
  public:
    /// One operator in one pass, by tensor.
    struct Call {
        std::size_t node = 0;
        bool replay = false;                    ///< in backward: repeats its node's forward pass
        std::vector<std::size_t> inputs;        ///< tensors; kNone for parameters and absent inputs
        std::vector<std::size_t> outputs;       ///< tensors
        std::vector<std::size_t> saved;         ///< tensors
        std::vector<std::size_t> grad_outputs;  ///< backward: tensors
        std::vector<std::size_t> zeros;  ///< tensors to be filled with zero before: gradients that
            ///< nothing reached, and row-major ones before the first sum
        std::vector<std::size_t> grad_inputs;  ///< tensor, or kNone if not computed
        /// Contributions to gradients that other calls have written: {contribution, sum}.
        std::vector<std::pair<std::size_t, std::size_t>> sums;
        bool passed = false;         ///< an input reuses the gradient of the output
        std::size_t addend = kNone;  ///< what grad_inputs[0] is added to
        std::size_t workspace = kNone;
        std::size_t prepared = kNone;  ///< prepared in this call, unless kept
    };
    static constexpr std::size_t kNone = ~std::size_t{0};

    enum class Home { kArenas, kKept, kGiven };  // kGiven: parameters' gradients, the caller's

    struct Tensor {
        Lifetime life;
        std::string name;
        vk::BufferView view;  ///< after place()
        Home home = Home::kArenas;
        std::uint32_t earliest = 0;  ///< when it might be written, if its memory were free
        std::uint64_t least = 0;     ///< bytes of its smaller form, if it has one
    };

    ExecutorPlan(const Graph& graph, const Parameters& parameters, const ExecutorDesc& desc)
        : graph_(graph), parameters_(parameters), desc_(desc) {}

    Status make();

    /// Allocate memory for the tensors of one home, kArenas or kKept, and set their views. Until kept
    /// parameters have theirs, calls prepare parameters themselves.
    Status place(vk::Context& context, Home home, std::vector<vk::Buffer>& buffers,
                 ExecutorMemory& memory);
    [[nodiscard]] bool has_kept() const { return kept_bytes_ > 0; }
    [[nodiscard]] bool keeps(const std::vector<std::size_t>& kept, const Call& call) const {
        return kept_placed_ && kept[call.node] != kNone;
    }

    /// The tensors of a node's forward pass or its replay, in the shapes that the node sees.
    [[nodiscard]] ops::OpViews forward_views(const Call& call) const;
    [[nodiscard]] ops::OpViews backward_views(const Call& call) const;

    /// The ends of as many parts of the backward pass, fewer if it has fewer calls.
    [[nodiscard]] std::vector<std::size_t> cut_backward(std::uint32_t parts) const;
    /// By parameter, the last call of the backward pass that adds to its gradient; kNone without one.
    [[nodiscard]] std::vector<std::size_t> last_calls() const;

    [[nodiscard]] vk::BufferView value_view(ValueId id) const;
    [[nodiscard]] vk::BufferView grad_view(ValueId id) const;
    [[nodiscard]] const vk::BufferView& view(std::size_t tensor) const {
        return tensors_[tensor].view;
    }

    std::vector<Call> forward;
    std::vector<Call> backward;            ///< in the order of execution
    std::map<ValueId, std::size_t> ports;  ///< row-major tensors of inputs and outputs
    std::map<ValueId, std::size_t> grad_ports;
    std::vector<std::size_t>
        kept_forward;  ///< by node: prepared parameters that may be kept, or kNone
    std::vector<std::size_t> kept_backward;  ///< the same for the backward pass

  private:
    std::size_t tensor(std::string name, std::uint64_t bytes, std::uint32_t first);
    /// Extend the lifetime to now; kept tensors stay kept.
    void touch(std::size_t tensor) {
        Lifetime& life = tensors_[tensor].life;
        life.last = std::max(life.last, clock_);
    }
    void keep(std::size_t tensor);
    /// Parameters prepared for a call, which depend on nothing that the list computes.
    std::size_t prepared(const Node& node, std::uint64_t bytes);
    std::size_t port(ValueId id, std::size_t tensor,
                     const std::map<ValueId, vk::BufferView>& given);
    Result<std::uint64_t> bytes_of(ValueId id) const;
    Status find_wanted();
    Status find_reached();
    Status plan_inputs();
    Status plan_forward();
    Status plan_outputs();
    Status plan_backward();
    Status plan_backward_node(std::size_t node);
    Status plan_replay(std::size_t first, std::size_t last);
    Status plan_results(Call& call);
    void find_crossing();
    [[nodiscard]] bool runs_backward(std::size_t node, const std::vector<bool>& wanted) const;
    Status plan_grad_input(Call& call, std::size_t input);
    bool pass_gradient(Call& call, std::size_t input);
    [[nodiscard]] std::vector<bool> wanted_inputs(std::size_t node) const;
    [[nodiscard]] bool keeps_prepared(const Node& node) const;
    void plan_prepared(Call& call, std::uint64_t bytes, std::uint64_t most, std::size_t& kept);
    ops::OpViews views(const Call& call) const;

    const Graph& graph_;
    const Parameters& parameters_;
    const ExecutorDesc desc_;
    std::uint32_t clock_ = 0;
    std::uint32_t backward_begin_ = 0;  ///< tick at which the list of the backward pass begins
    std::uint64_t kept_bytes_ = 0;      ///< bytes of prepared parameters so far
    bool kept_placed_ = false;
    std::vector<Tensor> tensors_;
    std::vector<bool> wanted_;   ///< by root value: its gradient is requested, or needed for one
    std::vector<bool> reached_;  ///< by root value: some grad_output depends on it
    std::vector<bool> crosses_;  ///< by root value: an output, or read outside of its own segment
    std::vector<std::size_t> values_;              ///< tensor of a root value, at this time
    std::vector<std::size_t> grads_;               ///< tensor of its gradient
    std::vector<std::vector<std::size_t>> saved_;  ///< by node, at this time
};

}  // namespace splat::nn
