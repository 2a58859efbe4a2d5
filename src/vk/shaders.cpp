#include "vk/shaders.h"

#include <unordered_map>

namespace splat::vk {
namespace {

constexpr std::size_t kSuffix = 4;  // "_cpu", "_gpu"

std::unordered_map<std::string_view, ShaderVariants> variants_by_stem() {
    std::unordered_map<std::string_view, ShaderVariants> table;
    for (const ShaderModule& module : shader_modules()) {
        const std::string_view name = module.name;
        if (name.ends_with("_cpu"))
            table[name.substr(0, name.size() - kSuffix)].cpu = &module;
        else if (name.ends_with("_gpu"))
            table[name.substr(0, name.size() - kSuffix)].gpu = &module;
        else
            table[name].plain = &module;
    }
    return table;
}

}  // namespace

const ShaderModule* find_shader(std::string_view name) {
    for (const ShaderModule& module : shader_modules())
        if (name == module.name) return &module;
    return nullptr;
}

ShaderVariants shader_variants(std::string_view stem) {
    // Never destroyed: threads may record while the process exits.
    static const auto* const table =
        new std::unordered_map<std::string_view, ShaderVariants>(variants_by_stem());
    const auto found = table->find(stem);
    return found != table->end() ? found->second : ShaderVariants{};
}

}  // namespace splat::vk
