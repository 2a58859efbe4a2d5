#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "train/gradient_exchange.h"

namespace splat::train {

/// The gradients of a batch: the sum of those of its slices, in an order that is the same for any number of ranks.
///
/// The tree of an even number of slices adds those of its halves; an odd number of slices add to the gradients one
/// after another. So P slices are 2^k trees of an odd number of slices, and each of up to 2^k ranks sums a subtree. It
/// takes log2 of its trees copies of the gradients. Then ranks add up theirs, see GradientExchange. All additions run
/// on the device, which may treat denormal numbers otherwise than the host.
///
/// Errors       kOutOfDeviceMemory; those of Context::run and of the group. With a group, sum() and add() give the
///              same status on all ranks
/// Determinism  bit-exact for any thread count and number of ranks, unless the group sums by itself
class GradientSum {
  public:
    /// For the gradients of `parameters` and `slices` slices in all, of which each rank has equally many. `group`:
    /// null: one rank. `adds`: add() is called. `parts`: those of a slice's backward pass.
    static Result<GradientSum> create(vk::Context& context, nn::Parameters& parameters,
                                      std::uint32_t slices, run::Group* group, bool adds,
                                      const nn::BackwardParts& parts = {});

    /// Adds the gradients of one of this rank's slices, calling `between`, if there is one, as Executor::backward does.
    using Slice = std::function<Status(std::uint32_t slice, const nn::BetweenParts& between)>;

    /// Sum those of all slices. The time of exchange that is not hidden behind the last slice, with the wait for other
    /// ranks, is added to `seconds`.
    Status sum(const Slice& slice, double& seconds);
    /// Add another such sum to the last one; with an odd number of slices those of one after another.
    Status add(const Slice& slice, double& seconds);

    /// The lists that a sum runs.
    [[nodiscard]] std::size_t lists() const;

  private:
    GradientSum(vk::Context& context, nn::Parameters& parameters)
        : context_(&context), parameters_(&parameters) {}
    /// A copy of the gradients, by block.
    using Copy = std::vector<vk::Buffer>;
    Result<Copy> allocate() const;
    Result<vk::CommandList> record_merge(std::uint32_t copies) const;
    Status prepare_exchange(run::Group& group, const nn::BackwardParts& parts);
    Status sum_here(const Slice& slice, const nn::BetweenParts& between);

    vk::Context* context_;
    nn::Parameters* parameters_;
    run::Group* group_ = nullptr;  ///< null: one rank
    std::vector<vk::BufferView> gradients_;
    std::uint32_t in_order_ = 1;           ///< slices of a tree that are not halved: an odd number
    std::uint32_t trees_ = 1;              ///< such trees of this rank: a power of two
    std::vector<Copy> waiting_;            ///< sums of 1, 2, 4... trees
    std::vector<vk::CommandList> merges_;  ///< by how many copies of waiting_ are added
    Copy before_;                          ///< the sum before add()
    vk::CommandList keep_, join_;          ///< gradients to before_, and the sum of both
    std::unique_ptr<GradientExchange> exchange_;  ///< with group_; adds what waits
};

}  // namespace splat::train
