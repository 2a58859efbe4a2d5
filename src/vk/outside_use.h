#pragma once

#include <atomic>
#include <cstdint>
#include <vector>

#include "core/fork.h"
#include "vk/buffer.h"

namespace splat::vk {

/// How others use device memory that an object owns and shares with them.
class OutsideUse {
  public:
    std::atomic<std::uint64_t> writes{0};  ///< writes so far
    /// Tensors whose pointer was given away: writes through it go unnoticed.
    std::atomic<std::uint32_t> exposed{0};

    void map(const BufferView& view);
    void unmap(const BufferView& view);
    /// True if any range is mapped.
    [[nodiscard]] bool mapped() const;
    /// True if a mapped range overlaps `view`.
    [[nodiscard]] bool mapped(const BufferView& view) const;

  private:
    mutable ForkMutex mutex_;
    std::vector<BufferView> mapped_;
};

}  // namespace splat::vk
