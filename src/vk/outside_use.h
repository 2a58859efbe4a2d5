#pragma once

#include <atomic>
#include <cstdint>

namespace splat::vk {

/// How others use device memory that an object owns and shares with them.
struct OutsideUse {
    std::atomic<std::uint64_t> writes{0};  ///< so far
    std::atomic<std::uint32_t> mapped{0};  ///< mappings that are open
    /// Tensors whose pointer was given away: writes through it go unnoticed.
    std::atomic<std::uint32_t> exposed{0};
};

}  // namespace splat::vk
