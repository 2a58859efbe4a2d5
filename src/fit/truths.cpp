#include "fit/truths.h"

#include <algorithm>

#include "core/checked_math.h"

namespace splat::fit {
namespace {

/// Photographs share buffers of up to this size: drivers limit the number of allocations and the size of bindings.
constexpr std::uint64_t kBufferBytes = std::uint64_t{64} << 20;
/// Multiple at which a binding may begin on every device (limits of Vulkan 1.2).
constexpr std::uint64_t kAlignment = 256;

std::uint64_t place_bytes(const data::PosedPhoto& photo) {
    return ceil_div(photo.pixels.size() * sizeof(std::uint32_t), kAlignment) * kAlignment;
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
            SPLAT_TRY(context.write(truth.pixels, photo.pixels.data(),
                                    photo.pixels.size() * sizeof(std::uint32_t)));
            made.views_.push_back(std::move(truth));
            at += place_bytes(photo);
        }
        made.buffers_.push_back(std::move(buffer));
    }
    return made;
}

}  // namespace splat::fit
