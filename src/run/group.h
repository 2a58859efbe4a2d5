#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "core/no_copy.h"
#include "core/status.h"

namespace splat::run {

/// What a group's ranks reach each other by: the members of splat_group, in whose header they are described.
struct GroupCalls {
    std::uint32_t rank = 0, count = 1;
    void* user = nullptr;
    std::int32_t (*send_receive)(void* user, std::uint32_t peer, const void* sent, void* received,
                                 std::uint64_t bytes) = nullptr;
    std::int32_t (*broadcast)(void* user, std::uint32_t root, void* data,
                              std::uint64_t bytes) = nullptr;
    std::int32_t (*barrier)(void* user) = nullptr;
    std::int32_t (*sum)(void* user, float* values, std::uint64_t count) = nullptr;
    const char* (*describe)(void* user, std::int32_t number) = nullptr;
};

/// The ranks of a run. All make the same calls in the same order.
///
/// Errors       kIo for a function that failed, with the ranks and what it says; from then on every call gives that
///              error, since nobody knows what other ranks have got
class Group : NoCopy {
  public:
    static constexpr std::uint32_t kMostRanks = 4096;

    /// Errors: kInvalidArgument for a count that is no power of two up to kMostRanks, a rank that is not below it, or
    /// functions that are missing.
    static Status check(const GroupCalls& calls);
    explicit Group(const GroupCalls& calls) : calls_(calls) {}

    [[nodiscard]] std::uint32_t rank() const { return calls_.rank; }
    [[nodiscard]] std::uint32_t count() const { return calls_.count; }
    [[nodiscard]] bool leads() const { return calls_.rank == 0; }
    /// Whether sums have a fixed order.
    [[nodiscard]] bool reproducible() const { return calls_.sum == nullptr; }

    /// Swap as many bytes with rank `peer`.
    Status exchange(std::uint32_t peer, std::span<const std::byte> sent,
                    std::span<std::byte> received);
    /// Give the bytes of a rank to all.
    Status broadcast(std::span<std::byte> data, std::uint32_t root = 0);
    /// The same of a text, whose length others do not know.
    Status broadcast(std::string& text, std::uint32_t root = 0);
    Status barrier();
    Status sum(std::span<float> values);

    /// Every rank's bytes, equally many, in the order of ranks: all.size() is count() * mine.size(). `mine` may lie in
    /// `all`, at its place.
    Status gather(std::span<const std::byte> mine, std::span<std::byte> all);

    /// The same status on every rank: OK if all ranks are, else that of the first rank which is not, with its number
    /// before its sentence (its own code), unless all ranks say the same. any: in, whether this rank has something;
    /// out, whether one has it.
    Status agree(const Status& mine, bool* any = nullptr);

    /// The error of the call that failed; OK before.
    [[nodiscard]] const Status& failed() const { return failed_; }

    /// Bytes that this rank has sent to others by exchange() and gather(), or given to sum().
    [[nodiscard]] std::uint64_t bytes_sent() const { return sent_; }

  private:
    Status failure(std::int32_t number, const std::string& what);

    GroupCalls calls_;
    Status failed_;  ///< the error of the first call that failed
    std::uint64_t sent_ = 0;
};

}  // namespace splat::run
