#pragma once

#include <algorithm>
#include <cstdint>
#include <optional>
#include <vector>

namespace splat::nn {

/// A tensor of one step: from the command that first writes it to the one that last uses it.
struct Lifetime {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    std::uint64_t bytes = 0;
};

/// What lists that run in levels (vk/levels.h) may take so that fewer of their commands wait only for memory.
struct Spread {
    std::uint32_t ticks = 2;  ///< a tensor's memory stays unused for as long after it
    /// Bound of what levels cost, workspaces of their own included: this part of the memory that is needed without, or
    /// these bytes if they are more. The environment variable SPLAT_LEVELS_MEMORY replaces both by a part.
    double part = 0.25;
    std::uint64_t bytes = std::uint64_t{64} << 20;

    [[nodiscard]] std::uint64_t most(std::uint64_t least) const {
        return least +
               std::max(static_cast<std::uint64_t>(part * static_cast<double>(least)), bytes);
    }
};

struct Placement {
    std::uint32_t arena = 0;
    std::uint64_t offset = 0;
};

struct MemoryPlan {
    std::vector<Placement> placements;  ///< one per lifetime
    std::vector<std::uint64_t> arena_bytes;
    [[nodiscard]] std::uint64_t bytes() const;  ///< all arenas together
};

/// Places tensors so that no two with overlapping lifetimes share a byte: the largest first, each at the
/// lowest free offset (greedy by size; within a few per cent of the lower bound for networks: Pisarchyk &
/// Lee 2020, arXiv:2001.03288).
///
/// alignment    of every offset
/// arena_limit  no arena grows beyond it, unless a single tensor does
MemoryPlan plan_memory(const std::vector<Lifetime>& lifetimes, std::uint64_t alignment,
                       std::uint64_t arena_limit);

/// The first of these plans that takes at most `most` bytes, if one does: tensors are kept apart for `ticks` after
/// their last, and may be written from tick `earliest` on; or from `ticks` before their first; or as by plan_memory.
std::optional<MemoryPlan> plan_spread(const std::vector<Lifetime>& lifetimes,
                                      const std::vector<std::uint32_t>& earliest,
                                      std::uint32_t ticks, std::uint64_t most,
                                      std::uint64_t alignment, std::uint64_t arena_limit);

/// Lower bound of any plan: the largest sum of bytes alive at once.
std::uint64_t peak_bytes(const std::vector<Lifetime>& lifetimes);

}  // namespace splat::nn
