#include "vk/pipeline.h"

#include "core/fault.h"
#include "core/log.h"
#include "params/spec_ids.h"
#include "vk/pipeline_cache_file.h"
#include "vk/shaders.h"

namespace splat::vk {
namespace {

VkDescriptorType vulkan_type(DescriptorType type) {
    return type == DescriptorType::kStorageBuffer ? VK_DESCRIPTOR_TYPE_STORAGE_BUFFER
                                                  : VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
}

/// "pipeline foo_gpu 0=256 10=1", which `tools/bench/devices --null` compiles for other devices.
std::string pipeline_text(const char* shader, const std::vector<SpecConstant>& constants) {
    std::string text = std::string("pipeline ") + shader;
    for (const SpecConstant& one : constants) text += format(" %u=%u", one.id, one.value);
    return text;
}

}  // namespace

Pipelines::Pipelines(Device& device, const std::string& cache_folder, unsigned threads)
    : device_(device) {
    if (!cache_folder.empty()) file_ = pipeline_cache_path(cache_folder, device.info());
    open_cache();
    compiler_.emplace(device, cache_, threads);
}

void Pipelines::open_cache() {
    std::vector<std::byte> data;
    if (!file_.empty())
        if (auto stored = read_pipeline_cache(file_, device_.info())) data = std::move(*stored);
    VkPipelineCacheCreateInfo info{.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO,
                                   .initialDataSize = data.size(),
                                   .pInitialData = data.data()};
    loaded_ = !data.empty();
    if (device_.vk.vkCreatePipelineCache(device_.handle(), &info, nullptr, &cache_) != VK_SUCCESS) {
        loaded_ = false;
        cache_ = VK_NULL_HANDLE;  // pipelines are then made without one
    }
}

Result<Pipeline*> Pipelines::get(const char* shader, const std::vector<SpecConstant>& constants) {
    Key key{shader, constants};
    if (device_.info().kind == DeviceKind::kCpu)
        key.constants.push_back(
            {params::kPackedStoresId, device_.info().features.packed_stores ? 1U : 0U});
    if (const auto found = pipelines_.find(key); found != pipelines_.end()) return &found->second;
    log(LogLevel::kDebug, pipeline_text(shader, constants));
    const auto entry = pipelines_.emplace(std::move(key), Pipeline{}).first;
    struct Undo {  // frees a partly created pipeline, also when memory runs out
        Pipelines* owner;
        decltype(entry) at;
        ~Undo() {
            if (owner == nullptr) return;
            owner->destroy(at->second);
            owner->pipelines_.erase(at);
        }
    } undo{this, entry};
    SPLAT_TRY(make(entry->second, shader, entry->first.constants));
    undo.owner = nullptr;
    return &entry->second;
}

void Pipelines::destroy(Pipeline& pipeline) noexcept {
    device_.vk.vkDestroyPipeline(device_.handle(), pipeline.job.pipeline, nullptr);
    device_.vk.vkDestroyPipelineLayout(device_.handle(), pipeline.layout, nullptr);
    device_.vk.vkDestroyDescriptorSetLayout(device_.handle(), pipeline.set_layout, nullptr);
}

Status Pipelines::make_layouts(Pipeline& pipeline) {
    std::vector<VkDescriptorSetLayoutBinding> bindings;
    for (const ShaderBinding& binding : pipeline.interface.bindings) {
        VkDescriptorSetLayoutBinding layout{.binding = binding.binding,
                                            .descriptorType = vulkan_type(binding.type),
                                            .descriptorCount = 1,
                                            .stageFlags = VK_SHADER_STAGE_COMPUTE_BIT};
        bindings.push_back(layout);
    }
    VkDescriptorSetLayoutCreateInfo set{
        .sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO,
        .bindingCount = static_cast<std::uint32_t>(bindings.size()),
        .pBindings = bindings.data()};
    SPLAT_TRY(device_.check(device_.vk.vkCreateDescriptorSetLayout(device_.handle(), &set, nullptr,
                                                                   &pipeline.set_layout),
                            "vkCreateDescriptorSetLayout"));

    const VkPushConstantRange push{VK_SHADER_STAGE_COMPUTE_BIT, 0, pipeline.interface.push_bytes};
    VkPipelineLayoutCreateInfo layout{.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO,
                                      .setLayoutCount = 1,
                                      .pSetLayouts = &pipeline.set_layout,
                                      .pushConstantRangeCount = push.size > 0 ? 1U : 0U,
                                      .pPushConstantRanges = &push};
    return device_.check(
        device_.vk.vkCreatePipelineLayout(device_.handle(), &layout, nullptr, &pipeline.layout),
        "vkCreatePipelineLayout");
}

Status Pipelines::make(Pipeline& pipeline, const char* shader,
                       const std::vector<SpecConstant>& constants) {
    const ShaderModule* embedded = find_shader(shader);
    if (embedded == nullptr)
        return error(Code::kInternal, "no shader named '%s' is built in", shader);
    SPLAT_ASSIGN(pipeline.interface, reflect(embedded->words));
    SPLAT_TRY(device_.check_storage_buffers(shader, pipeline.interface.storage_buffers()));
    SPLAT_TRY(make_layouts(pipeline));

    if (SPLAT_FAULT("vk.create_pipeline"))
        return device_.check(VK_ERROR_OUT_OF_DEVICE_MEMORY, "vkCreateComputePipelines");
    pipeline.job.module = embedded;
    pipeline.job.constants = constants;
    pipeline.job.layout = pipeline.layout;
    compiler_->add(pipeline.job);
    return {};
}

Status Pipelines::wait(Pipeline& pipeline) {
    const VkResult result = compiler_->wait(pipeline.job);
    if (result >= VK_SUCCESS) return {};
    if (result != VK_ERROR_OUT_OF_HOST_MEMORY && result != VK_ERROR_OUT_OF_DEVICE_MEMORY)
        ++refused_;
    return device_.check(result,
                         format("%s of %s", pipeline.job.call, pipeline.job.module->name).c_str());
}

void Pipelines::save() noexcept {
    const std::size_t compiled = compiler_->compiled();
    if (compiled == saved_ || file_.empty() || cache_ == VK_NULL_HANDLE) return;
    saved_ = compiled;  // a failure is not repeated for each list, either
    try {
        std::vector<std::byte> data;
        VkResult result = VK_INCOMPLETE;
        while (result == VK_INCOMPLETE) {  // threads may add to it between the calls
            std::size_t bytes = 0;
            if (device_.vk.vkGetPipelineCacheData(device_.handle(), cache_, &bytes, nullptr) !=
                VK_SUCCESS)
                return;
            data.resize(bytes);
            result =
                device_.vk.vkGetPipelineCacheData(device_.handle(), cache_, &bytes, data.data());
            data.resize(bytes);
        }
        if (result != VK_SUCCESS) return;
        if (!write_pipeline_cache(file_, device_.info(), data))
            log(LogLevel::kDebug, "the pipeline cache " + file_ + " could not be written");
    } catch (...) {
    }
}

void Pipelines::save_if_complete() noexcept {
    if (compiler_->compiled() >= pipelines_.size()) save();
}

Pipelines::~Pipelines() {
    compiler_->stop_threads();
    save();
    compiler_.reset();
    for (auto& [key, pipeline] : pipelines_) destroy(pipeline);
    if (cache_ != VK_NULL_HANDLE)
        device_.vk.vkDestroyPipelineCache(device_.handle(), cache_, nullptr);
}

}  // namespace splat::vk
