#pragma once

#include <algorithm>
#include <atomic>
#include <functional>
#include <optional>
#include <span>
#include <string>

#include "vk/batch.h"
#include "vk/device_mutex.h"
#include "vk/recorder.h"
#include "vk/submit.h"

namespace splat::vk {

struct ContextDesc {
    DeviceDesc device;
    MemoryDesc memory;
    std::uint64_t timeout_ns = 0;  ///< for one submit; 0 = 60 s; multiplied by SPLAT_TIMEOUT_SCALE
    std::string cache_folder;      ///< "" = no pipeline cache file
    bool profile = false;
    bool profile_levels = false;  ///< tests: time a CPU device as a GPU, see timers.h
};

/// An open device with its memory, pipelines, queue and profile.
///
/// Not thread-safe: code that shares it locks `mutex` around each use, as src/api does.
class Context : NoCopy {
  public:
    static Result<std::shared_ptr<Context>> create(const ContextDesc& desc);
    ~Context();

    [[nodiscard]] Device& device() { return *device_now_; }
    [[nodiscard]] Memory& memory() { return *memory_now_; }
    [[nodiscard]] Pipelines& pipelines() { return *pipelines_; }
    [[nodiscard]] Profile* profile() { return profile_enabled_ ? &profile_ : nullptr; }

    /// Do the part of run() that may take memory, for several lists that must all run or not at
    /// all.
    Status make_ready(CommandList& list) {
        SPLAT_TRY(queue_->make_ready(list));
        pipelines_->save_if_complete();
        return {};
    }

    /// Open the device anew, after a loss or a timeout: memory, pipelines and what the queue still does are left to the
    /// process, as a device that hangs cannot be destroyed. It is no application's, and nothing else is alive on it.
    /// Errors: those of create(); all stays as it was.
    Status reopen();

    [[nodiscard]] std::uint64_t timeout_ns() const { return timeout_ns_; }

    [[nodiscard]] bool profiles_levels() const { return profile_levels_; }

    /// Run a recorded list and add its times to the profile; within a BatchScope, note it.
    Status run(CommandList& list);

    /// While true, lists and transfers are left out of the profile.
    bool unprofiled = false;

    /// Lists noted within a BatchScope add their share of the time to it, by what their kernels are known to take.
    double* charge = nullptr;

    /// Submit what a BatchScope has noted, a list at least, and then the copy of `pixels` to an application's target,
    /// without waiting. Errors: those of Queue::submit_frame; then what was noted is dropped.
    Result<std::uint64_t> submit_frame(const BufferView& pixels, const FrameTarget& target);
    [[nodiscard]] std::uint64_t frame_semaphore() const { return queue_->semaphore(); }

    /// Wait for a list that timed out before, or a frame, if there is one.
    Status settle() { return queue_->settle(); }

    /// Copy between host memory and a view, through staging buffers where the view is not mapped.
    /// `bytes` <= view.bytes.
    /// Errors: those of Queue::run and Memory::allocate.
    Status write(const BufferView& view, const void* data, std::uint64_t bytes);
    Status read(const BufferView& view, void* data, std::uint64_t bytes);

    /// Call `use` with what the view holds now, once that is known: at once, or within a BatchScope when what it noted
    /// has run, in the order of these calls. It is never called if that fails.
    using Use = std::function<void(std::span<const std::byte>)>;
    Status read_later(const BufferView& view, std::uint64_t bytes, Use use);

    /// Whether a transfer of so many bytes can be noted in a BatchScope without running what is noted before it.
    [[nodiscard]] bool stages(std::uint64_t bytes) const;

    /// Run what BatchScopes have noted so far. Errors: those of Queue::run.
    Status flush();

    /// Number of the work that is noted now; 0 if there is none.
    [[nodiscard]] std::uint64_t noted() const { return noted_.empty() ? 0 : number_; }
    /// True if noted work of this number did not run to its end. What was to come from it is then not there.
    [[nodiscard]] bool dropped(std::uint64_t number) const {
        return std::ranges::binary_search(dropped_, number);
    }

    /// Fill a view with a 32-bit word, on the device.
    Status fill(const BufferView& view, std::uint32_t word);

    /// True in a child of the process that opened the device. The driver's threads do not exist
    /// there, so nothing of the context may be used or destroyed.
    [[nodiscard]] bool forked() const { return mutex.forked(); }

    DeviceMutex mutex;

  private:
    friend class BatchScope;
    Context() = default;
    [[nodiscard]] Profile* counting() { return unprofiled ? nullptr : profile(); }
    Status transfer(const BufferView& view, std::byte* to, const std::byte* from,
                    std::uint64_t bytes);

    std::unique_ptr<Device> device_;
    std::unique_ptr<Memory> memory_;
    // Calls that hold no mutex read these beside a reopen(), which keeps the old ones.
    std::atomic<Device*> device_now_ = nullptr;
    std::atomic<Memory*> memory_now_ = nullptr;
    std::unique_ptr<Pipelines> pipelines_;
    std::unique_ptr<Queue> queue_;
    Status reserve_staging(std::uint64_t bytes);
    Status run_now(CommandList& list) {
        SPLAT_TRY(make_ready(list));
        return queue_->run(list, counting());
    }
    void note(Noted noted);
    /// Staging memory for a noted copy; runs what is noted where that leaves too little.
    Result<BufferView> stage(std::uint64_t bytes);
    /// Forget noted work that did not run. Writes are kept: callers take them for done.
    void drop(std::vector<Noted> work) noexcept;
    void nothing_noted() noexcept;

    /// Kept between transfers: drivers of discrete devices take milliseconds to pin a new one.
    std::optional<Buffer> staging_;
    Batch* batch_ = nullptr;  ///< lists of the outermost BatchScope
    std::vector<Noted> noted_;
    std::uint64_t staged_ = 0;  ///< bytes of staging_ that noted copies use
    struct Later {
        BufferView stage;
        Use use;
    };
    std::vector<Later> later_;
    std::uint64_t number_ = 1;            ///< number of the work to note next
    std::vector<std::uint64_t> dropped_;  ///< numbers, rising
    Profile profile_;
    ContextDesc desc_;
    std::uint64_t timeout_ns_ = 0;
    bool profile_enabled_ = false;
    bool profile_levels_ = false;
};

}  // namespace splat::vk
