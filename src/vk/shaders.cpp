#include "vk/shaders.h"

namespace splat::vk {

const ShaderModule* find_shader(std::string_view name) {
    for (const ShaderModule& module : shader_modules())
        if (name == module.name) return &module;
    return nullptr;
}

}  // namespace splat::vk
