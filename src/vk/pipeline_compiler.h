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
};

/// Compiles pipelines on threads of its own in the order in which they were added, while the caller
/// goes on recording: the large kernels of the network take lavapipe 20 to 50 ms each.
class PipelineCompiler {
  public:
    /// `cache` may be null, and must outlive it.
    PipelineCompiler(Device& device, VkPipelineCache cache) : device_(device), cache_(cache) {}
    /// Jobs that no thread has begun are given up.
    ~PipelineCompiler();
    PipelineCompiler(const PipelineCompiler&) = delete;
    PipelineCompiler& operator=(const PipelineCompiler&) = delete;

    /// The job must stay where it is for as long as this object lives.
    void add(CompileJob& job);

    /// Until the job is done. One that failed before is tried again; so the result, the driver's, is
    /// of now.
    VkResult wait(CompileJob& job);

  private:
    void start_thread() noexcept;
    void work();
    void compile_next(std::unique_lock<std::mutex>& lock);
    VkResult compile(CompileJob& job) const noexcept;

    Device& device_;
    VkPipelineCache cache_;
    std::mutex mutex_;
    std::condition_variable changed_;
    std::vector<CompileJob*> queue_;  ///< few
    std::size_t idle_ = 0;            ///< threads that wait for a job
    bool stop_ = false;
    std::vector<std::thread> threads_;
};

}  // namespace splat::vk
