// List entries that the blending kernels skip. Their colours are NaN, so blending them would show
// even with weight 0.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "ops/op_harness.h"
#include "raster/blend.h"
#include "support/gpu_buffers.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kSide = 16;  // one tile
constexpr std::size_t kPixels = std::size_t{kSide} * kSide;

/// An entry of the tile's list.
struct Entry {
    float mean, opacity, l, red;  ///< mean on both axes; l: of both diagonal elements of L
};

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

bool all_finite(const std::vector<float>& values) {
    return std::all_of(values.begin(), values.end(), [](float x) { return std::isfinite(x); });
}

struct Blended {
    std::vector<float> image;
    std::vector<float> records;  ///< [3,n,4] of kernels for CPUs, else [n,3,4]
};

class BlendSkips : public KernelsTest {
  protected:
    /// Forward and backward over one tile that lists the entries.
    [[nodiscard]] Blended blend(const std::vector<Entry>& entries,
                                const raster::Skips& skips) const {
        raster::RasterDesc desc;
        desc.gaussians = static_cast<std::uint32_t>(entries.size());
        desc.width = desc.height = kSide;
        desc.backward = true;
        desc.skips = skips;
        std::vector<float> splats;
        std::vector<std::uint32_t> pairs, slots;
        for (const Entry& e : entries) {
            const float reach = 8;  // log2(255), rounded up
            splats.insert(splats.end(),
                          {e.mean, e.mean, e.opacity, 1, e.l, 0, e.l, reach, e.red, 0.5F, 0.5F, 0});
            pairs.insert(pairs.end(), {0, static_cast<std::uint32_t>(slots.size())});
            slots.push_back(static_cast<std::uint32_t>(slots.size()));
        }
        const std::size_t n = std::max<std::size_t>(entries.size(), 2);
        const vk::Buffer from = upload(context(), splats);
        const vk::Buffer list = upload(context(), pairs);
        const vk::Buffer record_places = upload(context(), slots);
        const vk::Buffer zeros = upload(context(), std::vector<float>(4));
        const vk::Buffer range =
            upload(context(), std::vector<std::uint32_t>{0, desc.gaussians, 0, 0});
        const vk::Buffer grad_image = upload(context(), std::vector<float>(4 * kPixels, 1.0F));
        const vk::Buffer image = device_buffer(context(), 4 * kPixels);
        const vk::Buffer state = device_buffer(context(), 2 * kPixels);
        const vk::Buffer extra = device_buffer(context(), 4);
        const vk::Buffer median = device_buffer(context(), 4);
        const bool apart = GetParam() == vk::Kernels::kCpu;
        std::vector<vk::Buffer> records;
        raster::RecordViews record_views;
        for (const std::size_t quads :
             apart ? std::vector<std::size_t>{n, n, n, 1} : std::vector<std::size_t>{3 * n}) {
            records.push_back(device_buffer(context(), 4 * quads));
            record_views.sums.push_back(records.back().range());
        }
        const raster::BlendViews views = {.splats = from.range(),
                                          .pairs = list.range(),
                                          .normals = zeros.range(),
                                          .slots = record_places.range(),
                                          .ranges = range.range(),
                                          .order = zeros.range(),
                                          .background = zeros.range(),
                                          .image = image.range(),
                                          .state = state.range(),
                                          .extra = extra.range(),
                                          .median = median.range()};
        vk::Recorder recorder(context());
        EXPECT_OK(raster::blend_forward(recorder, desc, {0, 1}, views, n));
        EXPECT_OK(raster::blend_backward(recorder, desc, {0, 1}, views, grad_image.range(),
                                         zeros.range(), record_views, n));
        auto commands = need(recorder.finish());
        EXPECT_OK(context().run(commands));
        Blended result{download(context(), image.range(), 4 * kPixels), {}};
        for (std::size_t i = 0; i < (apart ? 3 : 1); ++i) {
            const std::vector<float> part =
                download(context(), records[i].range(), (apart ? 4 : 12) * entries.size());
            result.records.insert(result.records.end(), part.begin(), part.end());
        }
        return result;
    }
};
SPLAT_INSTANTIATE_KERNELS(BlendSkips);

/// Three of the first eight stop every pixel. All kernels but the plain ones skip the rest.
TEST_P(BlendSkips, EndsWhereEveryPixelHasStopped) {
    std::vector<Entry> entries(8, {8, 1, 1e-3F, 0.5F});
    entries.resize(200, {8, 0.5F, 1e-3F, kNotANumber});
    const bool plain = GetParam() == vk::Kernels::kPlain;
    const Blended with = blend(entries, {});
    EXPECT_EQ(all_finite(with.image), !plain);
    EXPECT_EQ(all_finite(with.records), !plain);
    const Blended without = blend(entries, {.early_out = false});
    EXPECT_FALSE(all_finite(without.image));
    EXPECT_FALSE(all_finite(without.records));
    if (plain) return;
    const Blended seen = blend({entries.begin(), entries.begin() + 8}, {});
    EXPECT_EQ(with.image, seen.image);
    const std::size_t arrays = GetParam() == vk::Kernels::kCpu ? 3 : 1, floats = 12 / arrays;
    for (std::size_t k = 0; k < arrays; ++k)
        for (std::size_t i = 0; i < floats * entries.size(); ++i)
            ASSERT_EQ(with.records[floats * entries.size() * k + i],
                      i < floats * 8 ? seen.records[floats * 8 * k + i] : 0.0F)
                << k << ", " << i;
}

/// A point between the four blocks of the tile, which none of their pixels sees. Plain kernels have no blocks.
TEST_P(BlendSkips, LeavesOutWhatABlockCannotSee) {
    const std::vector<Entry> entries = {{8, 0.5F, 1e-3F, 0.5F}, {8, 0.5F, 30, kNotANumber}};
    const bool plain = GetParam() == vk::Kernels::kPlain;
    const Blended with = blend(entries, {});
    EXPECT_EQ(all_finite(with.image), !plain);
    EXPECT_EQ(all_finite(with.records), !plain);
    const Blended without = blend(entries, {.blocks = false});
    EXPECT_FALSE(all_finite(without.image));
    EXPECT_FALSE(all_finite(without.records));
}

}  // namespace
}  // namespace splat::test
