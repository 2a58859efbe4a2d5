#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "vk/device.h"
#include "vk/pipeline_compiler.h"
#include "vk/spirv.h"

namespace splat::vk {

struct Pipeline {
    VkPipelineLayout layout = VK_NULL_HANDLE;
    VkDescriptorSetLayout set_layout = VK_NULL_HANDLE;
    ShaderInterface interface;
    CompileJob job;
};

/// Compute pipelines by shader name and specialisation, created on first use and kept until the end.
/// They are compiled while the caller continues.
///
/// A cache file of the driver's compiled code, one per device and driver, speeds up the next process.
/// A file that is corrupt or of another driver is ignored and replaced. Failing to read or write it is
/// never an error.
class Pipelines : NoCopy {
  public:
    /// `cache_folder` "" = no file. `threads` as in PipelineCompiler.
    Pipelines(Device& device, const std::string& cache_folder, unsigned threads);
    ~Pipelines();

    /// Errors: kInternal for an unknown shader, and the driver's. The pointer lives as long as this
    /// object.
    Result<Pipeline*> get(const char* shader, const std::vector<SpecConstant>& constants);

    /// Wait until it is compiled; call it before binding. Errors: the driver's; the next call tries again.
    Status wait(Pipeline& pipeline);

    /// Waits that failed because the driver did not make the pipeline, and not for want of memory.
    [[nodiscard]] std::size_t refused() const { return refused_; }

    /// Write the cache file if anything was added.
    void save() noexcept;
    /// The same, once all that were asked for are compiled: a process that ends badly leaves its pipelines.
    void save_if_complete() noexcept;

    [[nodiscard]] const std::string& cache_file() const { return file_; }
    [[nodiscard]] bool cache_file_was_used() const { return loaded_; }

  private:
    struct Key {
        std::string shader;
        std::vector<SpecConstant> constants;
        auto operator<=>(const Key&) const = default;
    };
    Status make(Pipeline& pipeline, const char* shader, const std::vector<SpecConstant>& constants);
    Status make_layouts(Pipeline& pipeline);
    void destroy(Pipeline& pipeline) noexcept;
    void open_cache();

    Device& device_;
    std::string file_;
    VkPipelineCache cache_ = VK_NULL_HANDLE;
    bool loaded_ = false;
    std::size_t refused_ = 0;
    std::size_t saved_ = 0;  ///< compiled pipelines when the file was written last
    std::map<Key, Pipeline> pipelines_;
    std::optional<PipelineCompiler> compiler_;
};

}  // namespace splat::vk
