#include "vk/pipeline_compiler.h"

#include <algorithm>
#include <optional>

#include "core/fork.h"
#include "vk/spirv.h"
#include "vk/watchdog.h"

namespace splat::vk {
namespace {

/// More gain nothing: a network has few pipelines, and most are small.
constexpr unsigned kMostThreads = 4;

/// The compilers of the process. Never destroyed, because devices may live until its end.
struct Living {
    ForkMutex mutex;
    std::vector<PipelineCompiler*> compilers;
};
Living& living();

/// Their threads do not exist in the child, which must not wait for them.
void forget_compilers() {
    living().compilers.clear();
}

Living& living() {
    return for_ever<Living, forget_compilers>();
}

/// Ends their threads before the driver's static objects, which were constructed earlier, are destroyed, and
/// before this library is unloaded.
struct AtExit {
    ~AtExit() {
        const std::lock_guard lock(living().mutex);
        for (PipelineCompiler* compiler : living().compilers) compiler->stop_threads();
    }
};

}  // namespace

unsigned compile_threads(bool validation) {
    return validation ? 0 : std::clamp(std::thread::hardware_concurrency(), 1U, kMostThreads);
}

PipelineCompiler::PipelineCompiler(Device& device, VkPipelineCache cache, unsigned threads)
    : device_(device), cache_(cache), workers_(threads) {
    static const AtExit at_exit;
    const std::lock_guard lock(living().mutex);
    living().compilers.push_back(this);
}

PipelineCompiler::~PipelineCompiler() {
    {
        const std::lock_guard lock(living().mutex);
        std::erase(living().compilers, this);
    }
    stop_threads();
}

void PipelineCompiler::stop_threads() noexcept {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    for (Worker& worker : workers_)
        if (worker.thread.joinable()) worker.thread.join();
}

void PipelineCompiler::add(CompileJob& job) noexcept {
    const std::lock_guard lock(mutex_);
    enqueue(job);
}

/// Start one more thread if the maximum allows.
void PipelineCompiler::enqueue(CompileJob& job) noexcept {
    job.next = nullptr;
    (first_ == nullptr ? first_ : last_->next) = &job;
    last_ = &job;
    if (stop_) return;
    const auto worker = std::ranges::find_if(workers_, [](const Worker& one) { return one.ended; });
    if (worker == workers_.end()) return;
    if (worker->thread.joinable()) worker->thread.join();
    try {
        worker->thread = std::thread([this, worker] { work(*worker); });
        worker->ended = false;
    } catch (...) {  // the system has no thread left; other threads or wait() do the work
    }
}

void PipelineCompiler::work(Worker& worker) noexcept {
    std::unique_lock lock(mutex_);
    while (first_ != nullptr && !stop_) compile_next(lock);
    worker.ended = true;
}

void PipelineCompiler::compile_next(std::unique_lock<std::mutex>& lock) noexcept {
    CompileJob& job = *first_;
    first_ = job.next;
    lock.unlock();
    const VkResult result = compile(job);
    lock.lock();
    job.result = result;
    ++compiled_;
    changed_.notify_all();
}

VkResult PipelineCompiler::wait(CompileJob& job) noexcept {
    std::unique_lock lock(mutex_);
    if (job.result < VK_SUCCESS) {
        job.result = VK_NOT_READY;
        enqueue(job);
    }
    std::optional<Watchdog> watchdog;
    if (job.result == VK_NOT_READY)
        watchdog.emplace(device_.info().name.c_str(), "the compilation of", job.module->name);
    while (job.result == VK_NOT_READY) {
        if (first_ != nullptr)
            compile_next(lock);
        else
            changed_.wait(lock);
    }
    return job.result;
}

std::size_t PipelineCompiler::compiled() const noexcept {
    const std::lock_guard lock(mutex_);
    return compiled_;
}

VkResult PipelineCompiler::compile(CompileJob& job) const noexcept try {
    job.call = "vkCreateShaderModule";
    std::vector<VkSpecializationMapEntry> entries;
    for (std::size_t i = 0; i < job.constants.size(); ++i)
        entries.push_back(
            {job.constants[i].id,
             static_cast<std::uint32_t>(i * sizeof(SpecConstant) + offsetof(SpecConstant, value)),
             4});
    const VkSpecializationInfo specialization{static_cast<std::uint32_t>(entries.size()),
                                              entries.data(), job.constants.size_bytes(),
                                              job.constants.data()};
    std::vector<std::uint32_t> without_mode;
    std::span<const std::uint32_t> words = job.module->words;
    if (!device_.info().features.nan_mode) without_mode = without_nan_mode(words);
    if (!without_mode.empty() && without_mode.size() < words.size()) words = without_mode;
    VkShaderModuleCreateInfo code{.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO,
                                  .codeSize = words.size_bytes(),
                                  .pCode = words.data()};
    VkShaderModule module = VK_NULL_HANDLE;
    const VkResult made =
        device_.vk.vkCreateShaderModule(device_.handle(), &code, nullptr, &module);
    if (made != VK_SUCCESS) return made;
    job.call = "vkCreateComputePipelines";
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
