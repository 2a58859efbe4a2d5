#include "fit/truths.h"

#include <algorithm>
#include <numeric>

#include "core/checked_math.h"
#include "core/rng.h"

namespace splat::fit {
namespace {

/// Photographs share buffers of up to this size: drivers limit the number of allocations and the size of bindings.
constexpr std::uint64_t kBufferBytes = std::uint64_t{64} << 20;
/// Multiple at which a binding may begin on every device (limits of Vulkan 1.2).
constexpr std::uint64_t kAlignment = 256;

/// Bytes of `words` numbers for each pixel.
std::uint64_t plane_bytes(const data::PosedPhoto& photo, std::uint64_t words) {
    return round_up(photo.pixels.size() * words * sizeof(std::uint32_t), kAlignment);
}

/// Bytes of the photograph and, behind it, its maps.
std::uint64_t place_bytes(const data::PosedPhoto& photo) {
    const bool has_maps = !photo.nearness.empty() || !photo.normals.empty();
    return plane_bytes(photo, 1) + (has_maps ? plane_bytes(photo, 2) : 0);
}

std::vector<std::uint8_t> tiles_of(const data::PosedPhoto& photo) {
    constexpr std::uint32_t kTile = 16;
    const std::size_t columns = ceil_div(photo.width, kTile);
    std::vector<std::uint8_t> tiles(columns * ceil_div(photo.height, kTile), 0);
    for (std::size_t i = 0; i < photo.pixels.size(); ++i)
        if (photo.pixels[i] >> 24 == 255)
            tiles[i / photo.width / kTile * columns + i % photo.width / kTile] = 1;
    return tiles;
}

}  // namespace

Result<Truths> Truths::create(vk::Context& context, std::span<const data::PosedPhoto> photos) {
    Truths made;
    for (std::size_t first = 0; first < photos.size();) {
        std::uint64_t bytes = 0;
        std::size_t last = first;
        do {
            bytes += place_bytes(photos[last++]);
        } while (last < photos.size() && bytes + place_bytes(photos[last]) <= kBufferBytes);
        SPLAT_ASSIGN(vk::Buffer buffer,
                     context.memory().allocate(bytes, vk::MemoryKind::kDevice, "photographs"));
        std::uint64_t at = 0;
        for (; first < last; ++first) {
            const data::PosedPhoto& photo = photos[first];
            Truth truth;
            truth.camera = photo.camera;
            truth.pixels = buffer.range().part(at, vk::quad_bytes(photo.pixels.size()));
            truth.pixels.shape = {photo.height, photo.width};
            truth.valid = static_cast<std::uint32_t>(
                std::count_if(photo.pixels.begin(), photo.pixels.end(),
                              [](std::uint32_t pixel) { return pixel >> 24 == 255; }));
            truth.tiles = tiles_of(photo);
            SPLAT_TRY(context.write(truth.pixels, photo.pixels.data(),
                                    photo.pixels.size() * sizeof(std::uint32_t)));
            const std::vector<std::uint32_t> map = packed_maps(photo, truth.map_counts);
            if (!map.empty()) {
                truth.map = buffer.range().part(at + plane_bytes(photo, 1),
                                                map.size() * sizeof(std::uint32_t));
                SPLAT_TRY(context.write(truth.map, map.data(), truth.map.bytes));
            }
            made.views_.push_back(std::move(truth));
            at += place_bytes(photo);
        }
        made.buffers_.push_back(std::move(buffer));
    }
    std::size_t empty = 0, all = 0;
    for (const Truth& truth : made.views_) {
        empty += static_cast<std::size_t>(std::ranges::count(truth.tiles, 0));
        all += truth.tiles.size();
    }
    made.have_empty_tiles_ = 50 * empty >= all;
    return made;
}

std::vector<std::size_t> order_of_round(std::span<const data::PosedPhoto> photos,
                                        std::uint64_t seed, std::uint64_t round) {
    // A permutation (Fisher and Yates).
    std::vector<std::size_t> order(photos.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    for (std::size_t i = order.size(); i > 1; --i) {
        const auto word =
            philox({static_cast<std::uint32_t>(i), static_cast<std::uint32_t>(round), 0, 0},
                   {static_cast<std::uint32_t>(seed), static_cast<std::uint32_t>(seed >> 32)});
        std::swap(order[i - 1], order[((std::uint64_t{word[0]} << 32) | word[1]) % i]);
    }
    const auto size = [&](std::size_t i) { return std::pair(photos[i].width, photos[i].height); };
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return size(a) < size(b); });
    // A photograph alone in its size would have one place in all rounds, where a step may leave it out.
    if (round % 2 == 1 && size(order.front()) != size(order.back())) std::ranges::reverse(order);
    return order;
}

}  // namespace splat::fit
