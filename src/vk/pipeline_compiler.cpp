#include "vk/pipeline_compiler.h"

#include <algorithm>

namespace splat::vk {
namespace {

/// More would gain nothing on the few pipelines of a network, most of which are small.
constexpr unsigned kMostThreads = 4;

}  // namespace

PipelineCompiler::~PipelineCompiler() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
        queue_.clear();
    }
    changed_.notify_all();
    for (std::thread& thread : threads_) thread.join();
}

void PipelineCompiler::add(CompileJob& job) {
    const std::lock_guard lock(mutex_);
    queue_.push_back(&job);
    if (queue_.size() > idle_) start_thread();
    changed_.notify_all();
}

/// Without a thread, wait() does the work.
void PipelineCompiler::start_thread() noexcept {
    if (threads_.size() >= std::clamp(std::thread::hardware_concurrency(), 1U, kMostThreads))
        return;
    try {
        threads_.emplace_back([this] { work(); });
    } catch (...) {
    }
}

void PipelineCompiler::work() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        if (!queue_.empty()) {
            compile_next(lock);
            continue;
        }
        ++idle_;
        changed_.wait(lock, [this] { return stop_ || !queue_.empty(); });
        --idle_;
    }
}

void PipelineCompiler::compile_next(std::unique_lock<std::mutex>& lock) {
    CompileJob& job = *queue_.front();
    queue_.erase(queue_.begin());
    lock.unlock();
    const VkResult result = compile(job);
    lock.lock();
    job.result = result;
    changed_.notify_all();
}

VkResult PipelineCompiler::wait(CompileJob& job) {
    std::unique_lock lock(mutex_);
    if (job.result < VK_SUCCESS) {
        queue_.push_back(&job);
        job.result = VK_NOT_READY;
        changed_.notify_all();
    }
    while (job.result == VK_NOT_READY) {
        if (threads_.empty()) {
            compile_next(lock);
        } else {
            changed_.wait(lock);
        }
    }
    return job.result;
}

VkResult PipelineCompiler::compile(CompileJob& job) const noexcept try {
    std::vector<VkSpecializationMapEntry> entries;
    for (std::size_t i = 0; i < job.constants.size(); ++i)
        entries.push_back(
            {job.constants[i].id,
             static_cast<std::uint32_t>(i * sizeof(SpecConstant) + offsetof(SpecConstant, value)),
             4});
    const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()),
                                              entries.data(), job.constants.size_bytes(),
                                              job.constants.data()};
    VkShaderModuleCreateInfo code{};
    code.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
    code.codeSize = job.module->words.size_bytes();
    code.pCode = job.module->words.data();
    VkShaderModule module = VK_NULL_HANDLE;
    const VkResult made =
        device_.vk.vkCreateShaderModule(device_.handle(), &code, nullptr, &module);
    if (made != VK_SUCCESS) return made;
    VkComputePipelineCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
    info.flags =
        VK_PIPELINE_CREATE_DISPATCH_BASE;  // long dispatches are split by base group, see recorder.h
    info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
    info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
    info.stage.module = module;
    info.stage.pName = "main";
    info.stage.pSpecializationInfo = &specialization;
    info.layout = job.layout;
    const VkResult result = device_.vk.vkCreateComputePipelines(device_.handle(), cache_, 1, &info,
                                                                nullptr, &job.pipeline);
    device_.vk.vkDestroyShaderModule(device_.handle(), module, nullptr);
    return result;
} catch (...) {
    return VK_ERROR_OUT_OF_HOST_MEMORY;
}

}  // namespace splat::vk
