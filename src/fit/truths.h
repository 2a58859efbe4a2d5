#pragma once

#include <span>

#include "data/posed_photos.h"
#include "vk/context.h"

namespace splat::fit {

/// A photograph on the device.
struct Truth {
    scene::Camera camera;
    vk::BufferView pixels;    ///< [height,width] uint32, as in data::PosedPhoto
    std::uint32_t valid = 0;  ///< pixels that are there
};

/// Photographs of one size each, 8 bits a channel, on the device.
class Truths {
  public:
    /// Errors: kOutOfDeviceMemory, those of Context::write.
    static Result<Truths> create(vk::Context& context, std::span<const data::PosedPhoto> photos);

    [[nodiscard]] const Truth& at(std::size_t i) const { return views_[i]; }
    [[nodiscard]] std::size_t count() const { return views_.size(); }

  private:
    std::vector<vk::Buffer> buffers_;
    std::vector<Truth> views_;
};

}  // namespace splat::fit
