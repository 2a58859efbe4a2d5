#include "vk/spirv.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <vector>

#include "core/os/drivers.h"
#include "support/expect_status.h"
#include "vk/shaders.h"

namespace splat::vk {
namespace {

ShaderInterface interface_of(const char* name) {
    const ShaderModule* module = find_shader(name);
    EXPECT_NE(module, nullptr) << name;
    if (module == nullptr) return {};
    auto interface = reflect(module->words);
    EXPECT_TRUE(interface.ok()) << interface.status().message();
    return interface.ok() ? interface.value() : ShaderInterface{};
}

TEST(Spirv, ReadsBindingsAndPushConstants) {
    const ShaderInterface scale = interface_of("test_scale");
    ASSERT_EQ(scale.bindings.size(), 2U);
    EXPECT_TRUE(scale.bindings[0].reads);
    EXPECT_FALSE(scale.bindings[0].writes);
    EXPECT_FALSE(scale.bindings[1].reads);
    EXPECT_TRUE(scale.bindings[1].writes);
    EXPECT_EQ(scale.push_bytes, 8U);
    EXPECT_FALSE(scale.uses_num_workgroups);
    EXPECT_FALSE(scale.uses_float_atomics);

    const ShaderInterface accumulate = interface_of("test_accumulate");
    EXPECT_TRUE(accumulate.bindings[1].reads && accumulate.bindings[1].writes);
    EXPECT_EQ(accumulate.push_bytes, 4U);

    const ShaderInterface texel = interface_of("test_texel");
    EXPECT_EQ(texel.bindings[0].type, DescriptorType::kFloatTexelBuffer);
    EXPECT_TRUE(texel.bindings[0].reads);
    EXPECT_FALSE(texel.bindings[0].writes);
    EXPECT_EQ(texel.bindings[1].type, DescriptorType::kStorageBuffer);
    EXPECT_EQ(texel.storage_buffers(), 1U);
    EXPECT_EQ(scale.storage_buffers(), 2U);

    const ShaderInterface twice = interface_of("test_two_views");
    ASSERT_EQ(twice.bindings.size(), 2U);
    EXPECT_EQ(twice.bindings[0].binding, 0U);
    EXPECT_EQ(twice.bindings[1].binding, 1U);

    const ShaderInterface count = interface_of("test_count_groups");
    EXPECT_TRUE(count.uses_num_workgroups);
    EXPECT_EQ(count.push_bytes, 0U);
}

TEST(Spirv, FindsShadersByName) {
    EXPECT_EQ(find_shader("test_scal"), nullptr);
    EXPECT_EQ(find_shader(""), nullptr);
    for (const ShaderModule& module : shader_modules()) {
        EXPECT_EQ(find_shader(module.name), &module);
        EXPECT_EQ(std::string_view(module.sha256).size(), 64U);
    }
}

TEST(Spirv, FindsVariantsByStem) {
    const ShaderVariants both = shader_variants("test_accumulate");
    EXPECT_EQ(both.plain, find_shader("test_accumulate"));
    EXPECT_EQ(both.cpu, find_shader("test_accumulate_cpu"));
    EXPECT_EQ(both.gpu, nullptr);
    const ShaderVariants fast = shader_variants("test_ones");
    EXPECT_EQ(fast.plain, nullptr);
    EXPECT_EQ(fast.cpu, find_shader("test_ones_cpu"));
    EXPECT_EQ(fast.gpu, find_shader("test_ones_gpu"));
    const ShaderVariants none = shader_variants("test_ones_cpu");
    EXPECT_EQ(none.plain, nullptr);
    EXPECT_EQ(none.cpu, nullptr);
    EXPECT_EQ(none.gpu, nullptr);
}

TEST(Spirv, RefusesWhatIsNotAModule) {
    const std::vector<std::uint32_t> none;
    const std::vector<std::uint32_t> zeros(100, 0);
    EXPECT_ERROR(reflect(none), Code::kInternal, "SPIR-V");
    EXPECT_ERROR(reflect(zeros), Code::kInternal, "SPIR-V");
}

TEST(Spirv, RefusesABindingOfTwoMeanings) {
    const ShaderModule* module = find_shader("test_two_views");
    ASSERT_NE(module, nullptr);
    // Without the decoration NonReadable (25) of the second view of binding 1, that is read and the first is not. It is
    // one of the block's member; newer compilers decorate the variable, too.
    std::vector<std::uint32_t> words(module->words.begin(), module->words.end());
    constexpr std::uint32_t kNonReadable = 25, kRelaxedPrecision = 0;
    constexpr std::uint32_t kMemberDecorate = 4U << 16 | 72, kDecorate = 3U << 16 | 71;
    for (const std::uint32_t decorate : {kMemberDecorate, kDecorate})
        for (std::size_t at = words.size() - 4; at >= 5; --at) {
            std::uint32_t& decoration = words[at + (decorate == kMemberDecorate ? 3 : 2)];
            if (words[at] != decorate || decoration != kNonReadable) continue;
            decoration = kRelaxedPrecision;
            break;
        }
    EXPECT_ERROR(reflect(words), Code::kInternal, "two meanings");
}

/// Whether spirv-val takes the words.
bool valid(std::span<const std::uint32_t> words) {
    std::FILE* program = ::popen(SPLAT_SPIRV_VAL " --target-env vulkan1.2 -", "w");
    if (program == nullptr) return false;
    const bool written = std::fwrite(words.data(), 4, words.size(), program) == words.size();
    return ::pclose(program) == 0 && written;
}

TEST(Spirv, TakesOutTheModeOfNan) {
    const ShaderModule* plain = find_shader("test_scale");
    const ShaderModule* marked = find_shader("test_finite");
    ASSERT_TRUE(plain != nullptr && marked != nullptr);
    EXPECT_EQ(without_nan_mode(plain->words),
              std::vector<std::uint32_t>(plain->words.begin(), plain->words.end()));
    const std::vector<std::uint32_t> without = without_nan_mode(marked->words);
    EXPECT_EQ(without.size() + 6, marked->words.size());  // a capability of 2 words, a mode of 4
    if (os::kSystem == os::System::kWindows)
        GTEST_SKIP() << "spirv-val is a program of the system that builds";
    EXPECT_TRUE(valid(marked->words));
    EXPECT_TRUE(valid(without));
    EXPECT_FALSE(valid(std::span(without).first(without.size() - 1)));
}

TEST(Spirv, SurvivesTruncation) {
    for (const ShaderModule& module : shader_modules())
        for (std::size_t size = 0; size < module.words.size(); ++size)
            static_cast<void>(reflect(module.words.first(size)));
}

}  // namespace
}  // namespace splat::vk
