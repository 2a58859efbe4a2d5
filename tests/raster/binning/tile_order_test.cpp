// The order in which the blending kernels for CPU devices take the tiles.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "ops/op_harness.h"
#include "params/tile_bin_params.h"
#include "raster/tile_bin.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/require_vulkan.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Words = std::vector<std::uint32_t>;

raster::RasterDesc desc_of(std::uint32_t tiles) {
    raster::RasterDesc desc;
    desc.gaussians = 1;
    desc.width = 16 * tiles;
    desc.height = 16;
    return desc;
}

class TileOrder : public testing::Test {
  protected:
    void SetUp() override {
        const std::vector<vk::Kernels> kernels = kernels_to_test();
        if (std::find(kernels.begin(), kernels.end(), vk::Kernels::kCpu) == kernels.end())
            SPLAT_SKIP_FOR_DEVICE("this device does not run the kernels for CPUs");
        context_ = shared_context(vk::Kernels::kCpu);
        ASSERT_NE(context_, nullptr);
    }

    /// Checks the ranges of (up to 512) tiles with lists of these lengths, and returns their order.
    Words order_of(const Words& lengths) {
        Words ranges, pairs;
        for (std::uint32_t tile = 0; tile < lengths.size(); ++tile) {
            const auto first = static_cast<std::uint32_t>(pairs.size() / 2);
            ranges.insert(ranges.end(), {first, first + lengths[tile]});
            for (std::uint32_t i = 0; i < lengths[tile]; ++i) pairs.insert(pairs.end(), {tile, i});
        }
        const auto count = static_cast<std::uint32_t>(pairs.size() / 2);
        const auto tiles = static_cast<std::uint32_t>(lengths.size());
        pairs.insert(pairs.end(), {0, 0, 0, 0});  // beyond the last pair
        const vk::Buffer from = upload(*context_, pairs);
        const vk::Buffer sorted = upload(*context_, Words{count, 0, 0, 0});
        const vk::Buffer to = device_buffer(*context_, std::max(2 * tiles, 4U));
        const vk::Buffer order = device_buffer(*context_, std::max(tiles, 4U));
        const vk::Buffer stats = upload(*context_, Words(params::kStatWords, 0));
        vk::Recorder recorder(*context_);
        EXPECT_OK(raster::tile_ranges(recorder, desc_of(tiles), {0, 1}, from.range(),
                                      sorted.range(), {to.range(), order.range(), stats.range()}));
        auto list = need(recorder.finish());
        EXPECT_OK(context_->run(list));
        EXPECT_EQ(download_words(*context_, to.range(), 2 * tiles), ranges);
        const Words counts = download_words(*context_, stats.range(), params::kStatWords);
        EXPECT_EQ(counts[params::kStatLongest], *std::max_element(lengths.begin(), lengths.end()));
        EXPECT_EQ(counts[params::kStatEmptyTiles], std::count(lengths.begin(), lengths.end(), 0U));
        return download_words(*context_, order.range(), tiles);
    }

    vk::Context* context_ = nullptr;
};

TEST_F(TileOrder, DealsRanksBackAndForth) {
    // Ranks 0 to 7 dealt one by one: halves {0, 3, 4, 7} and {1, 2, 5, 6}, each dealt in the same
    // way.
    EXPECT_EQ(order_of({80, 70, 60, 50, 40, 30, 20, 10}), (Words{0, 7, 3, 4, 1, 6, 2, 5}));
    EXPECT_EQ(order_of({10, 20, 30, 40, 50, 60, 70, 80}), (Words{7, 0, 4, 3, 6, 1, 5, 2}));
    EXPECT_EQ(order_of({5, 5, 5, 5}), (Words{0, 3, 1, 2})) << "ties by index";
    EXPECT_EQ(order_of({7}), (Words{0}));
}

TEST_F(TileOrder, HasEachTileOnceAndRunsOfEqualLength) {
    for (const std::size_t tiles : {2, 9, 64, 135, 512}) {
        SCOPED_TRACE(tiles);
        Rng rng(tiles);
        Words lengths(tiles);
        for (std::uint32_t& length : lengths)
            length = rng.below(3) == 0 ? 0 : static_cast<std::uint32_t>(rng.below(1000));
        lengths[tiles / 2] = 5000;
        const Words order = order_of(lengths);
        Words sorted = order;
        std::sort(sorted.begin(), sorted.end());
        Words all(tiles);
        std::iota(all.begin(), all.end(), 0U);
        ASSERT_EQ(sorted, all);
        std::uint64_t sums[2] = {0, 0};
        for (std::size_t i = 0; i < tiles; ++i) sums[2 * i >= tiles ? 1 : 0] += lengths[order[i]];
        const std::uint64_t greater = std::max(sums[0], sums[1]);
        const std::uint64_t smaller = std::min(sums[0], sums[1]);
        // Dealt back and forth, the halves differ by at most the longest list. If the number of
        // tiles is not a power of two, their border may be off by one tile.
        EXPECT_LE(greater - smaller, 5000U + 1000U);
    }
}

TEST_F(TileOrder, IsNotUsedForManyTiles) {
    const vk::Recorder recorder(*context_);
    EXPECT_TRUE(raster::tile_order_used(recorder, desc_of(512), {0, 1}));
    EXPECT_FALSE(raster::tile_order_used(recorder, desc_of(513), {0, 1}));
    Words lengths(513, 2);
    lengths[7] = 0;
    order_of(lengths);
    vk::Context* plain = shared_context(vk::Kernels::kPlain);
    ASSERT_NE(plain, nullptr);
    EXPECT_FALSE(raster::tile_order_used(vk::Recorder(*plain), desc_of(4), {0, 1}));
}

}  // namespace
}  // namespace splat::test
