#pragma once

#include <condition_variable>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "vk/device.h"
#include "vk/shaders.h"

namespace splat::vk {

/// Value of one specialisation constant; floats go in by their bits.
struct SpecConstant {
    std::uint32_t id;
    std::uint32_t value;
    auto operator<=>(const SpecConstant&) const = default;
};

/// A shader that becomes a pipeline.
struct CompileJob {
    const ShaderModule* module = nullptr;
    std::span<const SpecConstant> constants;
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkPipeline pipeline = VK_NULL_HANDLE;
    VkResult result = VK_NOT_READY;
    const char* call = "";       ///< Vulkan function that returned the result
    CompileJob* next = nullptr;  ///< in the queue
};

/// Compiles pipelines in the order in which they were added, on threads that live while there is work. The
/// caller meanwhile continues recording: the network's large kernels take lavapipe 20 to 50 ms each.
class PipelineCompiler : NoCopy {
  public:
    /// `cache` may be null, and must outlive it. At most `threads` threads; with 0, wait() does all
    /// the work.
    PipelineCompiler(Device& device, VkPipelineCache cache, unsigned threads);
    /// Drops jobs that have not started.
    ~PipelineCompiler();

    /// The job must not move while this object lives.
    void add(CompileJob& job) noexcept;

    /// Wait until the job is done; the calling thread helps. A job that failed before is tried again, so
    /// the result is always fresh from the driver.
    VkResult wait(CompileJob& job) noexcept;

    /// Pipelines compiled so far, or refused by the driver.
    [[nodiscard]] std::size_t compiled() const noexcept;

    /// End the threads and return when they have; from then on wait() does the work.
    void stop_threads() noexcept;

  private:
    struct Worker {
        std::thread thread;
        bool ended = true;
    };
    void enqueue(CompileJob& job) noexcept;
    void work(Worker& worker) noexcept;
    void compile_next(std::unique_lock<std::mutex>& lock) noexcept;
    VkResult compile(CompileJob& job) const noexcept;

    Device& device_;
    VkPipelineCache cache_;
    mutable std::mutex mutex_;
    std::condition_variable changed_;  ///< a job is done
    CompileJob* first_ = nullptr;      ///< first job of the queue
    CompileJob* last_ = nullptr;
    std::size_t compiled_ = 0;
    bool stop_ = false;
    std::vector<Worker> workers_;
};

/// Number of threads for a device: 0 under validation, so that messages come on the thread that caused them.
unsigned compile_threads(bool validation);

}  // namespace splat::vk
