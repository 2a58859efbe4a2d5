#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

namespace splat::vk {

/// One SPIR-V module, embedded at build time. The table is generated from shaders/CMakeLists.txt.
struct ShaderModule {
    const char* name;  ///< "group_norm_forward_cpu": stem and variant
    std::span<const std::uint32_t> words;
    const char* sha256;  ///< of the words
};

std::span<const ShaderModule> shader_modules();

/// The module of that name, or nullptr.
const ShaderModule* find_shader(std::string_view name);

}  // namespace splat::vk
