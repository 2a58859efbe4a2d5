#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace splat::vk {

/// One SPIR-V module, embedded at build time. The table is generated from shaders/CMakeLists.txt.
struct ShaderModule {
    const char* name;  ///< "group_norm_forward_cpu": stem and variant
    std::span<const std::uint32_t> words;
    const char* sha256;  ///< hash of the words
};

std::span<const ShaderModule> shader_modules();

/// The module of that name, or nullptr.
const ShaderModule* find_shader(std::string_view name);

/// The modules of one kernel, `<stem>`, `<stem>_cpu` and `<stem>_gpu`; nullptr for one that is not
/// built in.
struct ShaderVariants {
    const ShaderModule* plain = nullptr;
    const ShaderModule* cpu = nullptr;
    const ShaderModule* gpu = nullptr;
};

/// All three are nullptr for an unknown stem.
ShaderVariants shader_variants(std::string_view stem);

}  // namespace splat::vk
