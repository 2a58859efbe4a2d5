#include "run/group.h"

#include <algorithm>
#include <bit>
#include <cstring>
#include <vector>

#include "core/hash.h"

namespace splat::run {

Status Group::check(const GroupCalls& calls) {
    if (calls.count == 0 || calls.count > kMostRanks || !std::has_single_bit(calls.count))
        return invalid(
            "group: %u ranks, expected 1, 2, 4... up to %u: sums in a fixed order need a power of "
            "two",
            calls.count, kMostRanks);
    if (calls.rank >= calls.count)
        return invalid("group: rank %u of %u, expected 0 to %u", calls.rank, calls.count,
                       calls.count - 1);
    if (calls.send_receive == nullptr || calls.broadcast == nullptr || calls.barrier == nullptr)
        return invalid("group: send_receive, broadcast and barrier must not be NULL");
    return {};
}

Status Group::failure(std::int32_t number, const std::string& what) {
    const char* const text =
        calls_.describe == nullptr ? nullptr : calls_.describe(calls_.user, number);
    failed_ =
        error(Code::kIo, "group: %s failed on rank %u of %u with %d%s%s", what.c_str(), rank(),
              count(), number, text == nullptr ? "" : ": ", text == nullptr ? "" : text);
    return failed_;
}

Status Group::exchange(std::uint32_t peer, std::span<const std::byte> sent,
                       std::span<std::byte> received) {
    SPLAT_ASSERT(sent.size() == received.size());
    SPLAT_TRY(failed_);
    const std::int32_t number =
        calls_.send_receive(calls_.user, peer, sent.data(), received.data(), sent.size());
    if (number != 0) return failure(number, format("send_receive with rank %u", peer));
    sent_ += sent.size();
    return {};
}

Status Group::broadcast(std::span<std::byte> data, std::uint32_t root) {
    SPLAT_TRY(failed_);
    if (count() == 1) return {};
    const std::int32_t number = calls_.broadcast(calls_.user, root, data.data(), data.size());
    return number == 0 ? Status() : failure(number, format("broadcast of rank %u", root));
}

Status Group::broadcast(std::string& text, std::uint32_t root) {
    std::uint64_t bytes = text.size();
    SPLAT_TRY(broadcast(std::as_writable_bytes(std::span(&bytes, 1)), root));
    text.resize(bytes);
    return broadcast(std::as_writable_bytes(std::span(text)), root);
}

Status Group::barrier() {
    SPLAT_TRY(failed_);
    const std::int32_t number = calls_.barrier(calls_.user);
    return number == 0 ? Status() : failure(number, "barrier");
}

Status Group::sum(std::span<float> values) {
    SPLAT_TRY(failed_);
    const std::int32_t number = calls_.sum(calls_.user, values.data(), values.size());
    if (number != 0) return failure(number, "sum");
    sent_ += values.size_bytes();
    return {};
}

/// Recursive doubling: before the step of `half` ranks each has the bytes of the aligned block of `half` ranks that it
/// is in.
Status Group::gather(std::span<const std::byte> mine, std::span<std::byte> all) {
    SPLAT_ASSERT(all.size() == count() * mine.size());
    if (!mine.empty()) std::memmove(&all[rank() * mine.size()], mine.data(), mine.size());
    for (std::uint32_t half = 1; half < count(); half *= 2) {
        const auto block = [&](std::uint32_t of) {
            return all.subspan((of & ~(half - 1)) * mine.size(), half * mine.size());
        };
        SPLAT_TRY(exchange(rank() ^ half, block(rank()), block(rank() ^ half)));
    }
    return {};
}

Status Group::agree(const Status& mine, bool* any) {
    struct Vote {
        std::int32_t code;
        std::uint32_t flag;
        std::uint64_t text;
    };
    Hash text;
    text.add(mine.message());
    const Vote vote{static_cast<std::int32_t>(mine.code()), any != nullptr && *any, text.value()};
    std::vector<Vote> votes(count());
    SPLAT_TRY(gather(std::as_bytes(std::span(&vote, 1)), std::as_writable_bytes(std::span(votes))));
    const auto same = [&](const Vote& other) {
        return other.code == vote.code && other.text == vote.text;
    };
    if (any != nullptr) *any = std::ranges::any_of(votes, &Vote::flag);
    if (std::ranges::all_of(votes, same)) return mine;
    for (std::uint32_t rank = 0; rank < count(); ++rank) {
        if (votes[rank].code == 0) continue;
        std::string said = mine.message();
        SPLAT_TRY(broadcast(said, rank));
        return {static_cast<Code>(votes[rank].code), format("rank %u: ", rank) + said};
    }
    return {};
}

}  // namespace splat::run
