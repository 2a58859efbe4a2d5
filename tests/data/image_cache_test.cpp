#include "data/image_cache.h"

#include <gtest/gtest.h>

#include <thread>

namespace splat::data {
namespace {

ImageCache::Pixels pixels(std::size_t bytes, std::uint8_t value) {
    return std::make_shared<const std::vector<std::uint8_t>>(bytes, value);
}

TEST(ImageCache, EvictsTheLeastRecentlyUsed) {
    ImageCache cache(10);
    cache.add(1, pixels(4, 1));
    cache.add(2, pixels(4, 2));
    EXPECT_NE(cache.find(1), nullptr);
    cache.add(3, pixels(4, 3));
    EXPECT_EQ(cache.find(2), nullptr);
    ASSERT_NE(cache.find(1), nullptr);
    EXPECT_EQ(cache.find(1)->front(), 1);
    EXPECT_EQ(cache.bytes(), 8U);
}

TEST(ImageCache, KeepsTheFirstOfAKeyAndNothingTooLarge) {
    ImageCache cache(10);
    cache.add(1, pixels(4, 1));
    cache.add(1, pixels(4, 2));
    cache.add(2, pixels(11, 3));
    EXPECT_EQ(cache.find(1)->front(), 1);
    EXPECT_EQ(cache.find(2), nullptr);
    EXPECT_EQ(cache.bytes(), 4U);
}

TEST(ImageCache, StaysWithinItsBytesWithSeveralThreads) {
    ImageCache cache(64);
    std::vector<std::thread> threads;
    for (std::uint64_t t = 0; t < 4; ++t)
        threads.emplace_back([&cache, t] {
            for (std::uint64_t i = 0; i < 500; ++i) {
                const std::uint64_t key = (i * 7 + t) % 23;
                cache.add(key, pixels(8, static_cast<std::uint8_t>(key)));
                const auto found = cache.find(key);
                if (found != nullptr) {
                    EXPECT_EQ(found->front(), key);
                }
                EXPECT_LE(cache.bytes(), 64U);
            }
        });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(cache.bytes(), 64U);
}

}  // namespace
}  // namespace splat::data
