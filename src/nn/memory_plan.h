#pragma once

#include <cstdint>
#include <vector>

namespace splat::nn {

/// A tensor of one step: from the command that first writes it to the one that last uses it.
struct Lifetime {
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    std::uint64_t bytes = 0;
};

struct Placement {
    std::uint32_t arena = 0;
    std::uint64_t offset = 0;
};

struct MemoryPlan {
    std::vector<Placement> placements;  ///< one per lifetime
    std::vector<std::uint64_t> arena_bytes;
};

/// Places tensors so that no two with overlapping lifetimes share a byte: the largest first, each at the
/// lowest free offset (greedy by size; within a few per cent of the lower bound for networks: Pisarchyk &
/// Lee 2020, arXiv:2001.03288).
///
/// alignment    of every offset
/// arena_limit  no arena grows beyond it, unless a single tensor does
MemoryPlan plan_memory(const std::vector<Lifetime>& lifetimes, std::uint64_t alignment,
                       std::uint64_t arena_limit);

/// Lower bound of any plan: the largest sum of bytes alive at once.
std::uint64_t peak_bytes(const std::vector<Lifetime>& lifetimes);

}  // namespace splat::nn
