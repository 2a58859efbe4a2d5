#include "raster/workspace.h"

#include <algorithm>

#include "core/checked_math.h"
#include "params/project_params.h"
#include "params/tile_bin_params.h"

namespace splat::raster {
namespace {

struct Wanted {
    vk::Buffer* buffer;
    const char* name;
    std::uint64_t bytes;
};

/// Allocate the buffers of `list`. Returns the sum of their bytes.
Result<std::uint64_t> allocate(vk::Context& context, const std::vector<Wanted>& list) {
    std::uint64_t sum = 0;
    for (const Wanted& wanted : list) {
        SPLAT_ASSIGN(*wanted.buffer,
                     context.memory().allocate(std::max<std::uint64_t>(wanted.bytes, 16),
                                               vk::MemoryKind::kDevice, wanted.name));
        sum += wanted.buffer->bytes();
    }
    return sum;
}

}  // namespace

Window pass_window(const RasterDesc& desc, std::uint32_t pass, std::uint32_t passes) {
    const auto [begin, end] = desc.drawn_rows();
    const std::uint32_t rows = end - begin;
    return {begin + rows * pass / passes, begin + rows * (pass + 1) / passes};
}

Status Workspace::allocate_items(vk::Context& context, const RasterDesc& desc) {
    const vk::Recorder recorder(context);
    const std::uint64_t items = std::max<std::uint64_t>(desc.items(), 1);
    const std::uint64_t sorted_items = 8 * radix_sort_entries(items);
    const std::uint64_t tiles = std::uint64_t{desc.tiles_x()} * desc.tiles_y() * desc.views;
    const bool cpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu;
    first_records_ = round_up(4 * items, kPartAlignment);
    const std::uint64_t image_gradients = desc.export_gradients ? 48 * items : 0;
    poses_ = desc.grad_pose ? round_up(image_gradients, kPartAlignment) : 0;
    SPLAT_ASSIGN(
        item_bytes_,
        allocate(context, {{&splats, "splats", 16 * desc.splat_quads() * items},
                           {&counts, "tile counts and first records",
                            first_records_ + (desc.backward ? 4 * items : 16)},
                           {&radii, "radii", 8 * items},
                           {&footprints, "footprints", 8 * items},
                           {&begins, "first pairs", cpu ? 16 : 4 * items},
                           {&large, "large footprints", 8 * items},
                           {&cameras, "cameras", std::uint64_t{16} * kCameraQuads * desc.views},
                           {&background, "background", 16 + std::uint64_t{16} * desc.views},
                           {&active_tiles, "active tiles", 4 * desc.mask_words() * desc.views},
                           {&view_ranges, "ranges of views",
                            std::uint64_t{4} * params::kRangeWords * desc.views},
                           {&item_keys, "depth keys", sorted_items},
                           {&item_order[0], "depth order", sorted_items},
                           {&item_order[1], "depth order", sorted_items},
                           {&item_count, "item count", 16},
                           {&sorted, "sorted count", 16},
                           {&sums, "scan sums", std::uint64_t{4} * tile_bin_lanes(recorder, desc)},
                           {&stats, "raster statistics", 4 * params::kStatWords},
                           {&pair_count, "pair count", 16},
                           {&kept_pairs, "pair count", 16},
                           {&ranges, "tile ranges", 8 * tiles},
                           {&order, "tile order", 4 * tiles},
                           {&image, "image", 16 * desc.pixels()},
                           {&state, "pixel state", 8 * desc.pixels()},
                           {&extra, "depth image", desc.extra ? 16 * desc.pixels() : 16},
                           {&median, "median depth", desc.median ? 4 * desc.pixels() : 16},
                           {&normals, "normals", desc.normals ? 16 * items : 16},
                           {&normal_image, "normal image", desc.normals ? 16 * desc.pixels() : 16},
                           {&exported, "image gradients and pose sums",
                            desc.grad_pose ? poses_ + pose_partial_bytes(recorder.device(), desc)
                                           : std::max<std::uint64_t>(image_gradients, 16)},
                           {&pose, "pose gradient", std::uint64_t{48} * desc.views},
                           {&intrinsics, "intrinsics gradient", std::uint64_t{16} * desc.views},
                           {&contributions, "contributions",
                            desc.contributions ? std::uint64_t{8} * desc.gaussians : 16}}));
    if (vk::Memory::host(stats.range()) == nullptr) {
        SPLAT_ASSIGN(seen_stats, context.memory().allocate(stats.bytes(), vk::MemoryKind::kStaging,
                                                           "raster statistics"));
    }
    SPLAT_ASSIGN(item_sort,
                 allocate_radix_sort(context, {.capacity = static_cast<std::uint32_t>(items)}));
    item_bytes_ += item_sort.bytes();
    return {};
}

Status Workspace::allocate_pairs(vk::Context& context, const RasterDesc& desc,
                                 std::uint32_t wanted) {
    pairs = {};
    capacity = 0;
    pair_bytes_ = 0;
    Pairs fresh;
    const std::uint64_t entries = 8 * radix_sort_entries(wanted);
    const std::uint64_t slots = desc.backward ? std::uint64_t{4} * wanted : 16;
    std::vector<Wanted> list = {{&fresh.entries[0], "pairs", entries},
                                {&fresh.entries[1], "pairs", entries},
                                {&fresh.slots[0], "record slots", slots},
                                {&fresh.slots[1], "record slots", slots}};
    std::vector<std::uint32_t> bytes_each = {16 * desc.record_quads()};
    if (context.device().kernels(vk::Family::kBlend) == vk::Kernels::kCpu)
        bytes_each = {16, 16, 16, desc.contributions ? 8U : 0U};
    fresh.records.resize(bytes_each.size());
    for (std::size_t i = 0; i < bytes_each.size(); ++i)
        list.push_back({&fresh.records[i], "gradient records",
                        desc.backward ? std::uint64_t{bytes_each[i]} * wanted : 0});
    SPLAT_ASSIGN(const std::uint64_t bytes, allocate(context, list));
    // Keys of a smaller window have fewer bits.
    SPLAT_ASSIGN(fresh.sort,
                 allocate_radix_sort(context, {.capacity = wanted,
                                               .key_bits = tile_key_bits(desc, {0, desc.tiles_y()}),
                                               .second = desc.backward}));
    pair_bytes_ = bytes + fresh.sort.bytes();
    pairs = std::move(fresh);
    capacity = wanted;
    return {};
}

std::uint32_t Workspace::max_capacity(const vk::Device& device, const RasterDesc& desc) {
    const vk::DeviceLimits& limits = device.info().limits;
    const bool cpu = device.kernels(vk::Family::kBlend) == vk::Kernels::kCpu;
    const std::uint64_t element = !desc.backward ? 8 : cpu ? 16 : 16 * desc.record_quads();
    std::uint64_t most =
        std::min<std::uint64_t>(limits.max_storage_buffer_bytes / element, kMaxSorted);
    if (cpu) most = std::min(most, limits.max_texel_elements / 2);
    return static_cast<std::uint32_t>(most / 4 * 4);  // see radix_sort_entries()
}

}  // namespace splat::raster
