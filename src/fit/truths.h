#pragma once

#include <span>

#include "fit/prior_maps.h"
#include "vk/context.h"

namespace splat::fit {

/// A photograph on the device.
struct Truth {
    scene::Camera camera;
    vk::BufferView pixels;    ///< [height,width] uint32, as in data::PosedPhoto
    std::uint32_t valid = 0;  ///< pixels that are there
    vk::BufferView map;       ///< packed_maps(); empty without maps
    PriorCounts map_counts;
    /// 1 for each tile of 16 x 16 pixels with one that is there, by rows.
    std::vector<std::uint8_t> tiles;
};

/// Photographs of one size each, 8 bits a channel, on the device.
class Truths {
  public:
    /// Errors: kOutOfDeviceMemory, those of Context::write.
    static Result<Truths> create(vk::Context& context, std::span<const data::PosedPhoto> photos);

    [[nodiscard]] const Truth& at(std::size_t i) const { return views_[i]; }
    [[nodiscard]] std::size_t count() const { return views_.size(); }
    /// True if tiles in which no pixel is there are at least a fiftieth: it then pays to leave them out.
    [[nodiscard]] bool have_empty_tiles() const { return have_empty_tiles_; }

  private:
    std::vector<vk::Buffer> buffers_;
    std::vector<Truth> views_;
    bool have_empty_tiles_ = false;
};

/// Views of a round in the order in which steps draw them: all of them, drawn by the seed. Those of one size follow
/// each other, because the views of a step have one size: from the smallest to the largest, in odd rounds back.
std::vector<std::size_t> order_of_round(std::span<const data::PosedPhoto> photos,
                                        std::uint64_t seed, std::uint64_t round);

}  // namespace splat::fit
