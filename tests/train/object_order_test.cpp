#include "train/object_order.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <numeric>
#include <thread>

#include "data/dataset.h"

namespace splat::train {
namespace {

constexpr std::uint64_t kOrderSeed = 5;
constexpr std::uint32_t kLarge = data::kMostListed + 1;

std::vector<std::uint32_t> pass_of(const ObjectOrder& order, std::uint32_t count,
                                   std::uint64_t pass) {
    std::vector<std::uint32_t> found(count);
    for (std::uint32_t i = 0; i < count; ++i) found[i] = order.at(pass * count + i);
    return found;
}

TEST(ObjectOrder, EachPassHasEveryObjectOnce) {
    for (const std::uint32_t count :
         {1U, 2U, 7U, data::kMostListed, kLarge, 100'003U, 131'072U, 131'073U, 1'000'000U})
        for (const std::uint64_t pass : {0, 1, 5}) {
            std::vector<std::uint32_t> found = pass_of(ObjectOrder(count, kOrderSeed), count, pass);
            std::ranges::sort(found);
            std::vector<std::uint32_t> all(count);
            std::iota(all.begin(), all.end(), 0U);
            EXPECT_TRUE(found == all) << count << " objects, pass " << pass;
        }
}

/// Resumed runs depend on it.
TEST(ObjectOrder, SetsThatHaveListsKeepTheOrderOfEarlierRuns) {
    for (const std::uint32_t count : {7U, 2'458U, data::kMostListed})
        for (const std::uint64_t pass : {0, 3})
            EXPECT_TRUE(pass_of(ObjectOrder(count, kOrderSeed), count, pass) ==
                        permutation(count, kOrderSeed, 2 * pass))
                << count;
    EXPECT_EQ(permutation(7, kOrderSeed, 0), (std::vector<std::uint32_t>{3, 4, 6, 2, 5, 1, 0}));
}

/// Positions of a large set depend on no list: far ones cost what near ones do, and threads need not agree on a pass.
TEST(ObjectOrder, IsTheSameFromAnyThread) {
    for (const std::uint32_t count : {1'000U, kLarge}) {
        const ObjectOrder order(count, kOrderSeed);
        std::vector<std::uint32_t> found(4 * 500);
        std::vector<std::thread> threads;
        for (std::uint32_t t = 0; t < 4; ++t)
            threads.emplace_back([&, t] {
                for (std::uint32_t i = 0; i < 500; ++i)
                    found[t * 500 + i] = order.at(count - 250 + i + std::uint64_t{t / 2} * count);
            });
        for (std::thread& thread : threads) thread.join();
        for (std::uint32_t t = 0; t < 4; ++t)
            for (std::uint32_t i = 0; i < 500; ++i)
                ASSERT_EQ(found[t * 500 + i],
                          ObjectOrder(count, kOrderSeed)
                              .at(count - 250 + i + std::uint64_t{t / 2} * count));
    }
}

TEST(ObjectOrder, SeedsAndPassesDiffer) {
    const std::vector<std::uint32_t> one = pass_of(ObjectOrder(kLarge, kOrderSeed), kLarge, 0);
    for (const auto& other : {pass_of(ObjectOrder(kLarge, kOrderSeed), kLarge, 1),
                              pass_of(ObjectOrder(kLarge, kOrderSeed + 1), kLarge, 0)}) {
        std::uint32_t same = 0;
        for (std::uint32_t i = 0; i < kLarge; ++i) same += one[i] == other[i] ? 1 : 0;
        EXPECT_LE(same, 10U) << "1 is expected of two random orders";
    }
}

/// Chi-squared of counts in 64 equal parts: 63 expected, with a deviation of 11.
double unevenness(const std::vector<std::uint32_t>& numbers, std::uint32_t below) {
    constexpr std::uint32_t kParts = 64;
    std::array<double, kParts> counts{};
    for (const std::uint32_t number : numbers) ++counts[std::uint64_t{number} * kParts / below];
    const double expected = static_cast<double>(numbers.size()) / kParts;
    double sum = 0;
    for (const double count : counts) sum += (count - expected) * (count - expected) / expected;
    return sum;
}

TEST(ObjectOrder, ALargeSetIsMixedAsIfAtRandom) {
    constexpr double kMost = 63 + 5 * 11;
    for (const std::uint32_t count : {kLarge, 131'072U, 1'000'000U}) {
        const ObjectOrder order(count, kOrderSeed);
        std::vector<std::uint32_t> first, steps, eighth;
        for (std::uint64_t pass = 0; pass < 4096; ++pass) first.push_back(order.at(pass * count));
        EXPECT_LE(unevenness(first, count), kMost) << "the first object of passes, of " << count;
        const std::vector<std::uint32_t> all = pass_of(order, count, 0);
        for (std::uint32_t i = 0; i + 1 < count; ++i)
            steps.push_back((all[i + 1] + count - all[i]) % count);
        EXPECT_LE(unevenness(steps, count), kMost) << "steps between neighbours, of " << count;
        for (std::uint32_t i = 0; i < count / 8; ++i) eighth.push_back(all[i]);
        EXPECT_LE(unevenness(eighth, count), kMost) << "the first eighth of a pass, of " << count;
    }
}

}  // namespace
}  // namespace splat::train
