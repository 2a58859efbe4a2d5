#pragma once

#include <memory>
#include <span>

#include "vk/buffer.h"

namespace splat::vk {

/// The application's image or buffer that receives a frame; opaque handles, as in include/splat/vulkan.h.
struct FrameTarget {
    std::uint64_t image = 0;   ///< 0: `buffer`
    std::uint64_t buffer = 0;  ///< from `offset` on
    std::uint64_t offset = 0;
    std::uint32_t width = 0, height = 0;
    std::uint32_t layout = 0;          ///< VkImageLayout afterwards
    std::uint64_t wait_semaphore = 0;  ///< before it is written; 0: none
    std::uint64_t wait_value = 0;
};

/// Copies frames into targets of the application, one at a time, and counts them by a timeline semaphore. Guarded as
/// the context is.
class Frames : NoCopy {
  public:
    /// Errors: the driver's.
    static Result<std::unique_ptr<Frames>> create(Device& device);
    /// The last frame has ended.
    ~Frames();

    [[nodiscard]] std::uint64_t semaphore() const;

    /// Submit command buffers one after the other and then the copy of `pixels`, as one call with `fence`. The frame
    /// before has ended. Returns the semaphore's value of this frame. Errors: the driver's; then nothing runs.
    Result<std::uint64_t> submit(std::span<const VkCommandBuffer> commands,
                                 const BufferView& pixels, const FrameTarget& target,
                                 VkFence fence);

  private:
    explicit Frames(Device& device) : device_(device) {}
    Status record(const BufferView& pixels, const FrameTarget& target);

    Device& device_;
    VkSemaphore semaphore_ = VK_NULL_HANDLE;
    VkCommandPool pool_ = VK_NULL_HANDLE;
    VkCommandBuffer commands_ = VK_NULL_HANDLE;
    std::uint64_t value_ = 0;  ///< the last frame's
};

}  // namespace splat::vk
