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
    const char* call = "";       ///< that gave the result
    CompileJob* next = nullptr;  ///< in the queue
};

/// Compiles pipelines in the order in which they were added, on threads that live as long as there is
/// work, while the caller goes on recording: the large kernels of the network take lavapipe 20 to 50 ms
/// each.
class PipelineCompiler {
  public:
    /// `cache` may be null, and must outlive it. threads  at most so many; without one, wait() does all
    /// the work
    PipelineCompiler(Device& device, VkPipelineCache cache, unsigned threads);
    /// Jobs that nobody has begun are given up.
    ~PipelineCompiler();
    PipelineCompiler(const PipelineCompiler&) = delete;
    PipelineCompiler& operator=(const PipelineCompiler&) = delete;

    /// The job must stay where it is for as long as this object lives.
    void add(CompileJob& job) noexcept;

    /// Until the job is done, with the calling thread's help. One that failed before is tried again; so
    /// the result, the driver's, is of now.
    VkResult wait(CompileJob& job) noexcept;

    /// Jobs that have become pipelines so far.
    [[nodiscard]] std::size_t compiled() const noexcept;

    /// From now on wait() does the work; returns when no thread is left.
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
    CompileJob* first_ = nullptr;      ///< of the queue
    CompileJob* last_ = nullptr;
    std::size_t compiled_ = 0;
    bool stop_ = false;
    std::vector<Worker> workers_;
};

/// For a device: none under validation, whose messages come on the thread that caused them.
unsigned compile_threads(bool validation);

}  // namespace splat::vk
