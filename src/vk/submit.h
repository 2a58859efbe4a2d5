#pragma once

#include <memory>

#include "vk/caller/frames.h"
#include "vk/command_list.h"
#include "vk/device_mutex.h"
#include "vk/memory.h"
#include "vk/timers.h"

namespace splat::vk {

/// Submits command lists and waits; the only place that waits for the device.
class Queue : NoCopy {
  public:
    /// `timeout_ns` bounds the wait for a segment; a suspension of the process counts as at most 0.5 s.
    Queue(Device& device, Memory& memory, const DeviceMutex& mutex, std::uint64_t timeout_ns)
        : device_(device), memory_(memory), mutex_(mutex), timeout_ns_(timeout_ns) {}
    ~Queue();

    /// Wait for a list that timed out before, compile this one's pipelines, and encode it. run() does it if
    /// this was not called. Errors: kCancelled between pipelines too; those of run().
    Status make_ready(CommandList& list);

    /// Run a list to its end, one segment ahead of the device, and learn from the segments' times. Errors: kTimeout if
    /// the device did not finish one (it may later; the next call first waits for it, and buffers freed meanwhile are
    /// not reused; segments not yet submitted do not run), kDeviceLost for ever after a loss, kCancelled if the call
    /// was cancelled, once the segments submitted have ended, and the driver's. A profile lacks times that host
    /// memory does not hold. After a timeout or a loss the message names the kernels that have not ended.
    Status run(CommandList& list, Profile* profile);

    /// Submit a list, and then the copy of `pixels` to an application's target, without waiting: the next use of the
    /// queue does. No times are learned. Returns the value of semaphore() that tells the end. Errors: those of run()
    /// before a submit.
    Result<std::uint64_t> submit_frame(CommandList& list, const BufferView& pixels,
                                       const FrameTarget& target);
    /// VkSemaphore of frames; for devices of an application, after a frame.
    [[nodiscard]] std::uint64_t semaphore() const { return frames_->semaphore(); }

    /// Wait for a list that timed out before, or a frame, if there is one. Errors: those of run().
    Status settle();
    [[nodiscard]] bool settled() const { return pending_ == nullptr; }

  private:
    Status submit(CommandList::Objects& objects, std::size_t segment);
    [[nodiscard]] VkResult wait_for(VkFence fence) const;
    void learn(CommandList::Objects& objects) const;
    Status wait(const std::shared_ptr<CommandList::Objects>& objects, std::size_t count);
    static Status naming_work(Status status, const CommandList::Objects& objects);
    Status read_times(const CommandList::Objects& objects, Profile& profile);

    Device& device_;
    Memory& memory_;
    const DeviceMutex& mutex_;
    std::uint64_t timeout_ns_;
    /// Timed out, or submitted with a frame, and not yet known to have ended.
    std::shared_ptr<CommandList::Objects> pending_;
    std::unique_ptr<Frames> frames_;  ///< made for the first one
};

}  // namespace splat::vk
