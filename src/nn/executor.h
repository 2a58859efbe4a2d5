#pragma once

#include <map>
#include <memory>
#include <vector>

#include "nn/graph.h"
#include "nn/memory_plan.h"
#include "nn/parameters.h"
#include "vk/context.h"

namespace splat::nn {

class ExecutorPlan;

struct ExecutorDesc {
    std::vector<ValueId> outputs;       ///< stay readable after forward and backward
    bool backward = false;              ///< plan and record the backward pass
    std::vector<ValueId> grad_outputs;  ///< outputs whose gradient the caller writes
    std::vector<ValueId> grad_inputs;   ///< inputs whose gradient is wanted
    /// Keep the prepared form of parameters that do not change, instead of preparing them anew in
    /// every run: faster, for up to four times the weights' memory. Without a backward pass that memory is
    /// taken by the second run of the same parameters, so that a single run neither fills nor waits for it,
    /// and done without where the device has not as much.
    bool keep_prepared = true;
    /// The backward pass keeps its own only while all that is kept stays within so many bytes. The default
    /// holds what a published network needs forward and most of what it needs backward: a step of
    /// adapters then fits in 2.5 GiB.
    std::uint64_t kept_bytes = std::uint64_t{1280} << 20;
    /// Do not keep for the backward pass what only nodes of one segment (Graph::begin_segment) read, but
    /// compute it once more there, from what the segments before gave: the same bits in less memory, for
    /// up to the time of another forward pass (Chen et al. 2016, arXiv:1604.06174).
    bool recompute = false;
    /// Row-major tensors of inputs and outputs, and of their gradients, that the caller owns; others get
    /// memory of the executor's. These must outlive it.
    std::map<ValueId, vk::BufferView> tensors = {}, gradients = {};
    /// Overwrite the gradients of row-major inputs in `gradients` instead of adding to them: for graphs in
    /// which one node reads each.
    bool overwrite = false;
    /// Give every tensor memory of its own. What a pass leaves then stays: backward can run again after
    /// the same forward, and saved() can be read.
    bool separate = false;
    const char* label = "activations";  ///< names the memory in errors
};

struct ExecutorMemory {
    std::uint64_t arenas = 0;    ///< bytes of activations, gradients, workspaces and what is kept
    std::uint64_t bound = 0;     ///< the least that any placement of them could take
    std::uint64_t prepared = 0;  ///< bytes of prepared parameters that are kept
};

/// Runs a graph: forward, and backward by the chain rule over its nodes in reverse.
///
/// Everything is planned once: which gradients are wanted (of trainable parameters, of grad_inputs,
/// and of what lies between those and grad_outputs; the rest costs nothing), when each tensor lives
/// and where; then command lists are recorded and re-submitted. A value that several nodes read
/// gets the sum of their gradients in the order of the backward pass. Gradients of parameters are
/// added to what is there (Parameters::zero_gradients starts a step), so batches can be split.
///
/// The graph and the parameters must outlive it.
class Executor {
  public:
    ~Executor();

    /// Errors: the graph's status(); kInvalidArgument for a grad_output that is no output or that
    /// nothing trainable leads to; kOutOfDeviceMemory.
    static Result<std::unique_ptr<Executor>> create(vk::Context& context, const Graph& graph,
                                                    Parameters& parameters,
                                                    const ExecutorDesc& desc);

    /// The row-major tensor of an input (to be written before forward) or of an output.
    [[nodiscard]] const vk::BufferView& tensor(ValueId id) const { return ports_.at(id); }

    /// The row-major gradient of a grad_output (to be written before backward) or of a grad_input.
    [[nodiscard]] const vk::BufferView& gradient(ValueId id) const { return grad_ports_.at(id); }

    Status forward();

    /// Once after each forward (unless ExecutorDesc::separate): it overwrites what forward left for it.
    /// kInvalidState otherwise, if made without, or if parameters have changed since; nothing is lost then.
    Status backward();

    /// Tensors that the nodes have saved for the backward pass, in their order; with ExecutorDesc::separate.
    [[nodiscard]] const std::vector<vk::BufferView>& saved() const { return saved_; }

    [[nodiscard]] const ExecutorMemory& memory() const { return memory_; }

  private:
    Executor(vk::Context& context, const Graph& graph, Parameters& parameters);
    Status record(const ExecutorPlan& plan, vk::CommandList& prepare,
                  vk::CommandList& forward) const;
    Status keep_prepared(ExecutorPlan& plan);

    vk::Context& context_;
    const Graph& graph_;
    Parameters& parameters_;
    std::map<ValueId, vk::BufferView> ports_;
    std::map<ValueId, vk::BufferView> grad_ports_;
    std::vector<vk::BufferView> saved_;
    std::vector<vk::Buffer> buffers_;
    vk::CommandList prepare_;
    vk::CommandList forward_;
    vk::CommandList backward_;
    std::unique_ptr<ExecutorPlan> plan_;  ///< until prepared parameters are kept
    std::uint64_t prepared_revision_ = 0;
    std::uint64_t ran_revision_ = 0;
    ExecutorMemory memory_;
    bool separate_ = false;
    bool ran_ = false;
};

}  // namespace splat::nn
