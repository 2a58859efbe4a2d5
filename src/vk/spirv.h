#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/status.h"

namespace splat::vk {

/// A texel buffer of floats is read as quads (samplerBuffer, RGBA32F), one of integers singly
/// (usamplerBuffer, R32UI) or as quads (isamplerBuffer, RGBA32I): GLSL has no other way to express it.
enum class DescriptorType : int {
    kStorageBuffer,
    kFloatTexelBuffer,
    kUintTexelBuffer,
    kIntQuadTexelBuffer
};

/// One binding of descriptor set 0 as the shader declares it, once or several times in the same way (an array
/// viewed as elements of two sizes).
struct ShaderBinding {
    std::uint32_t binding = 0;
    DescriptorType type = DescriptorType::kStorageBuffer;
    bool reads = true;   ///< not declared writeonly
    bool writes = true;  ///< not declared readonly

    bool operator==(const ShaderBinding&) const = default;
};

/// What a compute shader requires of its host, read from its SPIR-V.
struct ShaderInterface {
    std::vector<ShaderBinding> bindings;  ///< ascending and without gaps
    std::uint32_t push_bytes = 0;
    bool uses_num_workgroups = false;  ///< the shader cannot be split over several dispatches
    bool uses_float_atomics = false;

    [[nodiscard]] std::uint32_t storage_buffers() const;
};

/// Source: the SPIR-V specification 1.5, sections 2.3 (physical layout) and 3.20 (decorations).
/// Errors: kInternal for a module that is malformed or uses a kind of resource that the library
/// does not.
Result<ShaderInterface> reflect(std::span<const std::uint32_t> words);

/// The module without the execution mode of shaders/include/keep_nan.glsl, for devices that lack it.
std::vector<std::uint32_t> without_nan_mode(std::span<const std::uint32_t> words);

}  // namespace splat::vk
