#include "nn/memory_plan.h"

#include <gtest/gtest.h>

#include "support/rng_fill.h"

namespace splat::nn {
namespace {

std::vector<Lifetime> random_lifetimes(std::uint64_t seed, std::size_t count) {
    test::Rng rng(seed);
    std::vector<Lifetime> lifetimes(count);
    for (Lifetime& life : lifetimes) {
        life.first = static_cast<std::uint32_t>(rng.below(100));
        life.last = life.first + static_cast<std::uint32_t>(rng.below(20));
        life.bytes = rng.below(1000);
    }
    return lifetimes;
}

bool alive_together(const Lifetime& a, const Lifetime& b) {
    return a.first <= b.last && b.first <= a.last;
}

/// No two tensors that are alive together share a byte, all lie in their arena, aligned.
void expect_sound(const std::vector<Lifetime>& lifetimes, const MemoryPlan& plan,
                  std::uint64_t alignment) {
    ASSERT_EQ(plan.placements.size(), lifetimes.size());
    for (std::size_t i = 0; i < lifetimes.size(); ++i) {
        const Placement& a = plan.placements[i];
        EXPECT_EQ(a.offset % alignment, 0U);
        EXPECT_LE(a.offset + lifetimes[i].bytes, plan.arena_bytes[a.arena]);
        for (std::size_t j = 0; j < i; ++j) {
            const Placement& b = plan.placements[j];
            if (a.arena != b.arena || !alive_together(lifetimes[i], lifetimes[j])) continue;
            EXPECT_TRUE(a.offset + lifetimes[i].bytes <= b.offset ||
                        b.offset + lifetimes[j].bytes <= a.offset)
                << i << " and " << j;
        }
    }
}

TEST(MemoryPlan, LivingTensorsShareNoByte) {
    for (std::uint64_t seed = 1; seed < 20; ++seed) {
        const std::vector<Lifetime> lifetimes = random_lifetimes(seed, 120);
        for (const std::uint64_t limit : {std::uint64_t{1500}, std::uint64_t{1} << 30})
            expect_sound(lifetimes, plan_memory(lifetimes, 16, limit), 16);
    }
}

TEST(MemoryPlan, ArenasKeepTheirLimit) {
    const std::vector<Lifetime> lifetimes = random_lifetimes(7, 200);
    const MemoryPlan plan = plan_memory(lifetimes, 16, 2048);
    EXPECT_GT(plan.arena_bytes.size(), 1U);
    for (const std::uint64_t bytes : plan.arena_bytes) EXPECT_LE(bytes, 2048U);
}

TEST(MemoryPlan, ATensorBeyondTheLimitGetsAnArena) {
    const MemoryPlan plan = plan_memory({{0, 1, 5000}, {0, 1, 10}}, 16, 1000);
    EXPECT_EQ(plan.placements[0].offset, 0U);
    EXPECT_GE(plan.arena_bytes[plan.placements[0].arena], 5000U);
}

/// A chain, in which each tensor lives until the next is written, takes what its two greatest take.
TEST(MemoryPlan, AChainTakesTwoTensors) {
    std::vector<Lifetime> chain;
    for (std::uint32_t t = 0; t < 50; ++t) chain.push_back({t, t + 1, 1024});
    const MemoryPlan plan = plan_memory(chain, 16, 1 << 20);
    ASSERT_EQ(plan.arena_bytes.size(), 1U);
    EXPECT_EQ(plan.arena_bytes[0], 2048U);
    EXPECT_EQ(peak_bytes(chain), 2048U);
}

/// Greedy by size stays near the lower bound: 1.25 is far above what these lifetimes need (1.08), and
/// below what first-come placement takes (1.4).
TEST(MemoryPlan, StaysNearTheLowerBound) {
    for (std::uint64_t seed = 1; seed < 10; ++seed) {
        const std::vector<Lifetime> lifetimes = random_lifetimes(seed, 300);
        const MemoryPlan plan = plan_memory(lifetimes, 1, std::uint64_t{1} << 40);
        EXPECT_LE(static_cast<double>(plan.arena_bytes[0]),
                  1.25 * static_cast<double>(peak_bytes(lifetimes)))
            << seed;
    }
}

/// A plan that keeps reuse apart is sound for the longer lifetimes, and keeps within its bound.
TEST(MemoryPlan, SpreadKeepsItsDistanceAndItsBound) {
    for (std::uint64_t seed = 1; seed < 10; ++seed) {
        const std::vector<Lifetime> lifetimes = random_lifetimes(seed, 120);
        const std::uint64_t least = plan_memory(lifetimes, 16, 1 << 30).bytes();
        std::vector<std::uint32_t> earliest;
        for (std::size_t i = 0; i < lifetimes.size(); ++i)
            earliest.push_back(i % 5 == 0 ? lifetimes[i].first / 2
                                          : lifetimes[i].first + (i % 3 == 0 ? 1 : 0));
        for (const double part : {0.0, 0.1, 0.5, 10.0}) {
            const Spread spread{2, part, 0};
            const auto plan = plan_spread(lifetimes, earliest, 2, spread.most(least), 16, 1 << 30);
            ASSERT_TRUE(plan.has_value()) << "that of plan_memory is left";
            EXPECT_LE(static_cast<double>(plan->bytes()), (1 + part) * static_cast<double>(least));
            expect_sound(lifetimes, *plan, 16);
            if (part < 10) continue;
            std::vector<Lifetime> longer = lifetimes;
            for (std::size_t i = 0; i < longer.size(); ++i)
                longer[i] = {std::min(earliest[i], longer[i].first), longer[i].last + 2,
                             longer[i].bytes};
            expect_sound(longer, *plan, 16);
            EXPECT_FALSE(plan_spread(lifetimes, earliest, 2, least / 2, 16, 1 << 30).has_value());
        }
    }
}

}  // namespace
}  // namespace splat::nn
