#include "nn/memory_plan.h"

#include <algorithm>
#include <numeric>

#include "core/checked_math.h"

namespace splat::nn {
namespace {

struct Placed {
    std::size_t item;
    std::uint64_t begin;
    std::uint64_t end;
};

bool overlap(const Lifetime& a, const Lifetime& b) {
    return a.first <= b.last && b.first <= a.last;
}

/// The lowest offset of `bytes` bytes that avoids all placed tensors alive at the same time; `placed` is
/// ordered by begin.
std::uint64_t lowest_gap(const std::vector<Placed>& placed, const std::vector<Lifetime>& lifetimes,
                         const Lifetime& item, std::uint64_t bytes) {
    std::uint64_t offset = 0;
    for (const Placed& other : placed) {
        if (!overlap(lifetimes[other.item], item)) continue;
        if (offset + bytes <= other.begin) break;
        offset = std::max(offset, other.end);
    }
    return offset;
}

}  // namespace

MemoryPlan plan_memory(const std::vector<Lifetime>& lifetimes, std::uint64_t alignment,
                       std::uint64_t arena_limit) {
    std::vector<std::size_t> order(lifetimes.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return lifetimes[a].bytes > lifetimes[b].bytes;
    });
    MemoryPlan plan;
    plan.placements.resize(lifetimes.size());
    std::vector<std::vector<Placed>> arenas;
    for (const std::size_t item : order) {
        const std::uint64_t bytes = round_up(lifetimes[item].bytes, alignment);
        for (std::uint32_t arena = 0;; ++arena) {
            if (arena == arenas.size()) {
                arenas.emplace_back();
                plan.arena_bytes.push_back(0);
            }
            std::vector<Placed>& placed = arenas[arena];
            const std::uint64_t offset = lowest_gap(placed, lifetimes, lifetimes[item], bytes);
            if (offset + bytes > arena_limit && !placed.empty()) continue;
            plan.placements[item] = {arena, offset};
            plan.arena_bytes[arena] = std::max(plan.arena_bytes[arena], offset + bytes);
            const Placed entry{item, offset, offset + bytes};
            placed.insert(std::upper_bound(
                              placed.begin(), placed.end(), entry,
                              [](const Placed& a, const Placed& b) { return a.begin < b.begin; }),
                          entry);
            break;
        }
    }
    return plan;
}

std::uint64_t MemoryPlan::bytes() const {
    return std::accumulate(arena_bytes.begin(), arena_bytes.end(), std::uint64_t{0});
}

std::optional<MemoryPlan> plan_spread(const std::vector<Lifetime>& lifetimes,
                                      const std::vector<std::uint32_t>& earliest,
                                      std::uint32_t ticks, std::uint64_t most,
                                      std::uint64_t alignment, std::uint64_t arena_limit) {
    for (const std::uint32_t before : {~std::uint32_t{0}, ticks}) {
        std::vector<Lifetime> longer = lifetimes;
        for (std::size_t i = 0; i < longer.size(); ++i) {
            longer[i].last += ticks;
            longer[i].first -=
                std::min(before, longer[i].first - std::min(longer[i].first, earliest[i]));
        }
        MemoryPlan plan = plan_memory(longer, alignment, arena_limit);
        if (plan.bytes() <= most) return plan;
    }
    MemoryPlan plan = plan_memory(lifetimes, alignment, arena_limit);
    if (plan.bytes() > most) return std::nullopt;
    return plan;
}

std::uint64_t peak_bytes(const std::vector<Lifetime>& lifetimes) {
    std::uint32_t end = 0;
    for (const Lifetime& item : lifetimes) end = std::max(end, item.last + 1);
    std::vector<std::uint64_t> alive(end, 0);
    for (const Lifetime& item : lifetimes)
        for (std::uint32_t t = item.first; t <= item.last; ++t) alive[t] += item.bytes;
    return alive.empty() ? 0 : *std::max_element(alive.begin(), alive.end());
}

}  // namespace splat::nn
