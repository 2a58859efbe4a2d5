// The parallel sums of binning on GPUs, for any number of items.
#include <gtest/gtest.h>

#include <algorithm>

#include "ops/op_harness.h"
#include "params/tile_bin_params.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/require_vulkan.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Words = std::vector<std::uint32_t>;

constexpr std::uint32_t kMost = 0xFFFFFFFFU;

std::uint32_t saturating_add(std::uint32_t a, std::uint32_t b) {
    return a > kMost - b ? kMost : a + b;
}

/// Replaces each item by the sum of those before. Returns the sum of all.
std::uint32_t scan(Words& items) {
    std::uint32_t sum = 0;
    for (std::uint32_t& item : items) {
        const std::uint32_t own = item;
        item = sum;
        sum = saturating_add(sum, own);
    }
    return sum;
}

Words random_words(std::size_t count, std::uint32_t below) {
    Rng rng(count);
    Words words(count);
    for (std::uint32_t& word : words) word = static_cast<std::uint32_t>(rng.below(below));
    return words;
}

class TileBinScan : public testing::Test {
  protected:
    void SetUp() override {
        const std::vector<vk::Kernels> kernels = kernels_to_test();
        if (std::find(kernels.begin(), kernels.end(), vk::Kernels::kGpu) == kernels.end())
            SPLAT_SKIP_FOR_DEVICE("this device does not run the kernels for GPUs");
        context_ = shared_context(vk::Kernels::kGpu);
        ASSERT_NE(context_, nullptr);
    }

    /// A buffer of whole quads.
    [[nodiscard]] vk::Buffer quads(Words words) const {
        words.resize((words.size() + 3) / 4 * 4, 12345);
        return upload(*context_, words);
    }

    static void dispatch(vk::Recorder& recorder, const char* shader,
                         const params::TileBinParams& params, std::vector<vk::Access> accesses,
                         std::uint32_t groups, bool by_index = false) {
        EXPECT_OK(recorder.dispatch({
            .op = "tile_bin",
            .shader = shader,
            .constants = {{params::kWorkgroupSizeId, 256},
                          {params::kTileBinByIndexId, by_index ? 1U : 0U}},
            .push = params,
            .accesses = std::move(accesses),
            .groups = {groups, 1, 1},
            .work = {.flops = 1, .bytes = 1},
            .kernels = vk::Kernels::kGpu,
        }));
    }

    void expect_sums(Words sums, std::uint32_t capacity) {
        const vk::Buffer in_place = upload(*context_, sums);
        const vk::Buffer sorted = upload(*context_, Words{77, 0, 0, 0});
        const vk::Buffer stats = upload(*context_, Words(params::kStatWords, 0));
        const vk::Buffer pairs = device_buffer(*context_, 4);
        params::TileBinParams params{};
        params.lanes = static_cast<std::uint32_t>(sums.size());
        params.capacity = capacity;
        vk::Recorder recorder(*context_);
        dispatch(recorder, "tile_bin_scan", params,
                 {vk::read_write(in_place.range()), vk::read(sorted.range()),
                  vk::write(stats.range()), vk::write(pairs.range())},
                 1);
        auto list = need(recorder.finish());
        EXPECT_OK(context_->run(list));
        const std::uint32_t all = scan(sums);
        EXPECT_TRUE(download_words(*context_, in_place.range(), sums.size()) == sums);
        const Words counts = download_words(*context_, stats.range(), 3);
        const std::uint32_t made = all <= capacity ? all : 0;
        EXPECT_EQ(counts, (Words{77, all, made}));
        EXPECT_EQ(download_words(*context_, pairs.range(), 1), Words{made});
    }

    /// Offsets of the first `used` items, in the order of `order` or by index.
    void expect_offsets(const Words& tiles, std::uint32_t used, bool by_index) {
        const auto count = static_cast<std::uint32_t>(tiles.size());
        Words order, expected;
        for (std::uint32_t i = 0; i < count; ++i) {
            const std::uint32_t item = count - 1 - i;
            order.insert(order.end(), {i, item});
            if (by_index || i < used) expected.push_back(tiles[by_index ? i : item]);
        }
        scan(expected);
        params::TileBinParams params{};
        params.items = count;
        params.lanes = (count + 4 * 4096 - 1) / (4 * 4096) * 4;
        const vk::Buffer counts = quads(tiles), by_depth = quads(order), sorted = quads({used});
        const vk::Buffer sums = quads(Words(params.lanes)), ordered = quads(Words(2 * count));
        const vk::Buffer begins = quads(Words(count)), stats = quads(Words(params::kStatWords));
        const vk::Buffer pairs = quads({0});
        params.capacity = kMost;
        vk::Recorder recorder(*context_);
        dispatch(recorder, "tile_bin_reduce", params,
                 {vk::read(counts.range()), vk::read(by_depth.range()), vk::read(sorted.range()),
                  vk::write(sums.range()), vk::write(ordered.range())},
                 params.lanes, by_index);
        dispatch(recorder, "tile_bin_scan", params,
                 {vk::read_write(sums.range()), vk::read(sorted.range()), vk::write(stats.range()),
                  vk::write(pairs.range())},
                 1, by_index);
        dispatch(recorder, "tile_bin_offsets", params,
                 {vk::read(by_index ? counts.range() : ordered.range()), vk::read(sorted.range()),
                  vk::read(sums.range()), vk::write(begins.range())},
                 params.lanes, by_index);
        auto list = need(recorder.finish());
        EXPECT_OK(context_->run(list));
        EXPECT_TRUE(download_words(*context_, begins.range(), expected.size()) == expected);
    }

    vk::Context* context_ = nullptr;
};

TEST_F(TileBinScan, SumsAnyNumber) {
    for (const std::size_t sums : {4, 8, 1020, 1024, 1028, 4096, 4100, 20004}) {
        SCOPED_TRACE(sums);
        expect_sums(random_words(sums, 1000), kMost);
        expect_sums(random_words(sums, 1000), 100);
    }
}

TEST_F(TileBinScan, StaysAtTheLargestSum) {
    Words sums = random_words(4100, 1U << 21);
    expect_sums(sums, kMost - 1);
    sums = Words(8, 0);
    sums[1] = kMost;
    sums[6] = 3;
    expect_sums(sums, kMost - 1);
}

TEST_F(TileBinScan, FindsWhereEachItemBegins) {
    for (const std::uint32_t items : {1U, 2U, 3U, 5U, 4095U, 4096U, 4097U, 50003U}) {
        SCOPED_TRACE(items);
        const Words tiles = random_words(items, 50);
        expect_offsets(tiles, items, true);
        expect_offsets(tiles, items, false);
        expect_offsets(tiles, items / 2, false);
    }
}

}  // namespace
}  // namespace splat::test
