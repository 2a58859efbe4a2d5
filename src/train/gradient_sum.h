#pragma once

#include <functional>
#include <vector>

#include "nn/parameters.h"
#include "run/group.h"
#include "vk/context.h"

namespace splat::train {

/// The gradients of a batch: the sum of those of its slices, in an order that is the same for any number of ranks.
///
/// The tree of an even number of slices adds those of its halves; an odd number of slices add to the gradients one
/// after another. So P slices are 2^k trees of an odd number of slices, and each of up to 2^k ranks sums a subtree. It
/// takes log2 of its trees copies of the gradients. Then ranks add up in pairs, in pairs of pairs and so on: of pieces
/// of the gradients each sends the half that its partner sums, and in the end gets the sums back. All additions run on
/// the device, which may treat denormal numbers otherwise than the host.
///
/// Errors       kOutOfDeviceMemory; those of Context::run and of the group. With a group, sum() and add() give the
///              same status on all ranks
/// Determinism  bit-exact for any thread count and number of ranks, unless the group sums by itself
class GradientSum {
  public:
    /// For the gradients of `parameters` and `slices` slices in all, of which each rank has equally many. `group`:
    /// null: one rank. `adds`: add() is called.
    static Result<GradientSum> create(vk::Context& context, nn::Parameters& parameters,
                                      std::uint32_t slices, run::Group* group, bool adds);

    /// Adds the gradients of one of this rank's slices.
    using Slice = std::function<Status(std::uint32_t slice)>;

    /// Sum those of all slices. The time of exchange, with the wait for other ranks, is added to `seconds`.
    Status sum(const Slice& slice, double& seconds);
    /// Add another such sum to the last one; with an odd number of slices those of one after another.
    Status add(const Slice& slice, double& seconds);

    /// The lists that a sum runs.
    [[nodiscard]] std::size_t lists() const;

  private:
    GradientSum(vk::Context& context, nn::Parameters& parameters, run::Group* group)
        : context_(&context), parameters_(&parameters), group_(group) {}
    /// A copy of the gradients, by block.
    using Copy = std::vector<vk::Buffer>;
    /// A piece of the gradients, and the additions of what partners send of it, by level.
    struct Piece {
        vk::BufferView view;
        std::vector<vk::CommandList> adds;
    };
    /// The parts of a piece, first ... end - 1 of as many as there are ranks.
    struct Parts {
        std::uint64_t first = 0, end = 0;
    };
    Result<Copy> allocate() const;
    Result<vk::CommandList> record_merge(std::uint32_t copies) const;
    Status prepare_pieces();
    Status sum_here(const Slice& slice);
    Status exchange(const Status& here);
    Status exchange(Piece& piece, Status& device);
    [[nodiscard]] std::uint64_t part_bytes(std::uint64_t piece) const;
    /// The bytes of a piece that its parts have.
    [[nodiscard]] vk::BufferView view_of(const Piece& piece, const Parts& parts) const;
    /// What a rank sums after `levels` levels.
    [[nodiscard]] Parts kept(std::uint32_t levels, std::uint32_t rank) const;

    vk::Context* context_;
    nn::Parameters* parameters_;
    run::Group* group_;
    std::vector<vk::BufferView> gradients_;
    std::uint32_t in_order_ = 1;           ///< slices of a tree that are not halved: an odd number
    std::uint32_t trees_ = 1;              ///< such trees of this rank: a power of two
    std::vector<Copy> waiting_;            ///< sums of 1, 2, 4... trees
    std::vector<vk::CommandList> merges_;  ///< by how many copies of waiting_ are added
    Copy before_;                          ///< the sum before add()
    vk::CommandList keep_, join_;          ///< gradients to before_, and the sum of both
    std::vector<Piece> pieces_;
    vk::Buffer received_;
    std::vector<std::byte> host_, from_partner_;
};

}  // namespace splat::train
