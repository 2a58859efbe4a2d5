#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <vector>

#include "nn/executor.h"
#include "run/group.h"
#include "train/exchange_thread.h"
#include "vk/context.h"

namespace splat::train {

/// The sum of the gradients of all ranks, which begins while the last backward pass of this rank runs.
///
/// Ranks add up in pairs, in pairs of pairs and so on: of pieces of the gradients each sends the half that its partner
/// sums, and in the end gets the sums back. A piece is sent when a part of the pass has made it final. The owner's
/// thread does all work of the device, between parts; another one calls the group meanwhile.
///
/// All ranks make the same calls of the group in the same order, whatever fails on them: one agreement after the first
/// part, after which every piece is exchanged, and one at the end.
class GradientExchange : NoCopy {
  public:
    /// Blocks of the gradients. A piece is added to each of `addends`, copies by block, before it is sent.
    struct Memory {
        std::vector<vk::BufferView> gradients;
        std::vector<std::vector<vk::BufferView>> addends;
    };
    /// `parts`: without final_in, gradients are final after the last part. Errors: kOutOfDeviceMemory.
    static Result<std::unique_ptr<GradientExchange>> create(vk::Context& context, run::Group& group,
                                                            const nn::Parameters& parameters,
                                                            const nn::BackwardParts& parts,
                                                            const Memory& memory);

    /// Make this rank's gradients by `pass`, whose last backward pass calls what it is given, and sum them. The same
    /// status on all ranks. Time that is not hidden behind the pass, with the wait for other ranks, is added to
    /// `seconds`.
    using Pass = std::function<Status(const nn::BetweenParts& between)>;
    Status sum(const Pass& pass, double& seconds);

    /// The lists that one sum runs.
    [[nodiscard]] std::size_t lists() const;

  private:
    GradientExchange(vk::Context& context, run::Group& group, std::uint32_t parts)
        : context_(context), group_(group), parts_(parts) {}
    /// A piece of the gradients: after which part it is final, the addition of addends, and the additions of what
    /// partners send of it, by level.
    struct Piece {
        vk::BufferView view;
        std::uint32_t final_in = 0;
        vk::CommandList merge = {};
        std::vector<vk::CommandList> adds = {};
    };
    /// Host memory of a piece that is on its way.
    struct Slot {
        std::vector<std::byte> host, from_partner;
    };
    /// A piece on its way: the call that was posted for it, and how many are done.
    struct Moving {
        std::size_t piece = 0, slot = 0;
        std::uint32_t done = 0;
        std::uint64_t call = 0;
    };
    /// The shares of a piece, first ... end - 1 of as many as there are ranks.
    struct Shares {
        std::uint64_t first = 0, end = 0;
    };
    void cut(const nn::Parameters& parameters, const nn::BackwardParts& parts,
             const vk::BufferView& block);
    Status record(const Memory& memory);
    Status record(Piece& piece, const Memory& memory);
    void begin(ExchangeThread& thread);
    Status after(std::uint32_t part, Status here, double& seconds);
    Status move_pieces(std::uint32_t part);
    Status move_first();
    void start_pieces(std::uint32_t part);
    void post(Moving& moving);
    void take(const Moving& moving);
    void read(const Moving& moving, const Shares& shares);
    void write(const vk::BufferView& view, std::span<const std::byte> bytes);
    void run(vk::CommandList& list);
    [[nodiscard]] std::span<std::byte> host_of(const Moving& moving, const Shares& shares);
    [[nodiscard]] std::uint64_t share_bytes(std::uint64_t piece) const;
    /// The bytes of a piece that its shares have.
    [[nodiscard]] vk::BufferView view_of(const Piece& piece, const Shares& shares) const;
    /// What a rank sums after `levels` levels.
    [[nodiscard]] Shares kept(std::uint32_t levels, std::uint32_t rank) const;
    [[nodiscard]] std::uint32_t levels() const;
    /// Calls for a piece: the levels up and down, or the group's sum.
    [[nodiscard]] std::uint32_t calls() const { return group_.reproducible() ? 2 * levels() : 1; }
    [[nodiscard]] std::uint32_t partner_of(std::uint32_t level) const {
        return group_.rank() ^ (1U << level);
    }

    vk::Context& context_;
    run::Group& group_;
    std::uint32_t parts_;
    std::vector<Piece> pieces_;  ///< in the order in which they are final
    std::vector<Slot> slots_;
    vk::Buffer received_;
    // State of the sum that runs:
    ExchangeThread* thread_ = nullptr;
    std::deque<Moving> moving_;
    std::vector<std::size_t> free_;  ///< slots
    std::size_t started_ = 0;        ///< pieces
    std::uint32_t next_ = 0;         ///< part
    Status ended_;                   ///< why no call of the group follows, the same on all ranks
    Status device_;  ///< the first error here, after which partners still get as many bytes
};

}  // namespace splat::train
