#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <vector>

#include "nn/graph.h"
#include "nn/memory_plan.h"
#include "nn/parameters.h"
#include "vk/context.h"

namespace splat::nn {

class ExecutorPlan;

/// The parts of a backward pass, and the part after which the gradient of each parameter does not change any more.
struct BackwardParts {
    std::uint32_t count = 1;
    std::vector<std::uint32_t>
        final_in;  ///< by index of Parameters::all(); 0 where none is computed
};

/// Called between the parts of a backward pass, with the number of the one that was run.
using BetweenParts = std::function<Status(std::uint32_t part)>;

struct ExecutorDesc {
    std::vector<ValueId> outputs;  ///< readable after forward and backward
    bool backward = false;         ///< plan and record the backward pass
    /// Lists of the backward pass, at most. They are cut so that calls and bytes of final gradients are shared out
    /// evenly, in the same places on any device.
    std::uint32_t backward_parts = 1;
    std::vector<ValueId> grad_outputs;  ///< outputs for which the caller writes gradients
    std::vector<ValueId> grad_inputs;   ///< inputs for which gradients are computed
    /// Keep the prepared form of parameters that do not change, instead of preparing them in every run:
    /// faster, for up to four times the weights' memory. Without a backward pass the second run of the same
    /// parameters takes that memory, so that a single run neither fills nor waits for it. If the device has
    /// too little, nothing is kept.
    bool keep_prepared = true;
    /// Limit on kept bytes up to which the backward pass also keeps its own prepared form. The default holds
    /// what a published network needs forward and most of what it needs backward: a step of adapters then
    /// fits in 2.5 GiB.
    std::uint64_t kept_bytes = std::uint64_t{1280} << 20;
    /// Recompute values that only nodes of one segment (Graph::begin_segment) read in the backward pass, from
    /// the outputs of earlier segments, instead of keeping them: the same bits in less memory, for up to the
    /// time of another forward pass (Chen et al. 2016, arXiv:1604.06174).
    bool recompute = false;
    /// Tensors of inputs and outputs, and of their gradients, that the caller owns; others get memory of the
    /// executor's. These must outlive it.
    std::map<ValueId, vk::BufferView> tensors = {}, gradients = {};
    /// Activations whose tensors and gradients are quads, as operators take them; those of others are row-major.
    /// Backward adds to an input's that `gradients` has, and may overwrite an output's.
    std::set<ValueId> quads = {};
    /// Overwrite the gradients of row-major inputs in `gradients` instead of adding to them: for graphs in
    /// which one node reads each.
    bool overwrite = false;
    /// Give every tensor its own memory. The results of a pass then stay: backward can run again after
    /// the same forward, and saved() can be read.
    bool separate = false;
    /// What lists in levels may take more. If the device has less, they take what others do.
    Spread spread = {};
    const char* label = "activations";  ///< names the memory in errors
};

struct ExecutorMemory {
    std::uint64_t arenas = 0;    ///< bytes of activations, gradients, workspaces and kept values
    std::uint64_t bound = 0;     ///< lower bound of any placement of them
    std::uint64_t prepared = 0;  ///< bytes of prepared parameters that are kept
};

/// Runs a graph: forward, and backward by the chain rule over its nodes in reverse.
///
/// Everything is planned once: which gradients are computed (of trainable parameters, of grad_inputs,
/// and of values between those and grad_outputs; others cost nothing), and when and where each tensor
/// lives. Then command lists are recorded and submitted again and again. A value that several nodes
/// read gets the sum of their gradients in the order of the backward pass. Gradients of parameters
/// accumulate (Parameters::zero_gradients starts a step), so batches can be split.
///
/// The graph and the parameters must outlive it.
class Executor {
  public:
    ~Executor();

    /// Errors: the graph's status(); kInvalidArgument for a grad_output that is not an output or
    /// depends on nothing trainable; kOutOfDeviceMemory.
    static Result<std::unique_ptr<Executor>> create(vk::Context& context, const Graph& graph,
                                                    Parameters& parameters,
                                                    const ExecutorDesc& desc);

    /// The tensor of an input (to be written before forward) or of an output, row-major unless ExecutorDesc::quads.
    [[nodiscard]] const vk::BufferView& tensor(ValueId id) const { return ports_.at(id); }

    /// The gradient of a grad_output (to be written before backward) or of a grad_input, laid out alike.
    [[nodiscard]] const vk::BufferView& gradient(ValueId id) const { return grad_ports_.at(id); }

    Status forward();

    /// Call once after each forward (unless ExecutorDesc::separate): it overwrites forward's saved values.
    /// kInvalidState otherwise, without ExecutorDesc::backward, or if parameters have changed since;
    /// gradients are then unchanged. An error of `between` ends the pass.
    Status backward(const BetweenParts& between = {});

    [[nodiscard]] const BackwardParts& parts() const { return parts_; }

    /// Tensors that the nodes have saved for the backward pass, in their order; with ExecutorDesc::separate.
    [[nodiscard]] const std::vector<vk::BufferView>& saved() const { return saved_; }

    /// Thread-safe; waits for no pass.
    [[nodiscard]] ExecutorMemory memory() const {
        const std::lock_guard lock(memory_mutex_);
        return memory_;
    }

  private:
    Executor(vk::Context& context, const Graph& graph, Parameters& parameters);
    Result<std::unique_ptr<ExecutorPlan>> placed(ExecutorDesc desc);
    Status record(const ExecutorPlan& plan, vk::CommandList& prepare,
                  vk::CommandList& forward) const;
    Status record_backward(const ExecutorPlan& plan, const ExecutorDesc& desc);
    Status keep_prepared(ExecutorPlan& plan);
    void forget_dropped();

    vk::Context& context_;
    const Graph& graph_;
    Parameters& parameters_;
    std::map<ValueId, vk::BufferView> ports_;
    std::map<ValueId, vk::BufferView> grad_ports_;
    std::vector<vk::BufferView> saved_;
    std::vector<vk::Buffer> buffers_;
    vk::CommandList prepare_;
    vk::CommandList forward_;
    std::vector<vk::CommandList> backward_;  ///< by part
    BackwardParts parts_;
    std::unique_ptr<ExecutorPlan> plan_;  ///< null once prepared parameters are kept
    std::uint64_t prepared_revision_ = 0;
    std::uint64_t ran_revision_ = 0;
    std::uint64_t noted_ = 0;          ///< Context::noted() of the latest forward pass
    mutable std::mutex memory_mutex_;  ///< guards memory_
    ExecutorMemory memory_;
    bool separate_ = false;
    bool ran_ = false;
};

}  // namespace splat::nn
