// Under validation, with guards and with faults; tests/api/concurrent/external_test.cpp has other processes.
#include "vk/external_memory.h"

#include <gtest/gtest.h>

#include <filesystem>

#include "core/fault.h"
#include "core/os/file.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"

namespace splat::vk {
namespace {

using namespace test;

std::size_t open_files() {
    using Entries = std::filesystem::directory_iterator;
    return static_cast<std::size_t>(std::distance(Entries("/proc/self/fd"), Entries()));
}

/// A buffer that can be exported, or nothing where the device has none: then with the sentence that tells so.
std::optional<Buffer> exportable(Context& context, std::uint64_t bytes) {
    auto made = context.memory().allocate(bytes, MemoryKind::kExternal, "shared");
    if (context.device().info().features.external_memory) {
        EXPECT_OK(made);
        return std::move(made.value());
    }
    EXPECT_ERROR(made, Code::kUnsupported, "copy the elements");
    return std::nullopt;
}

/// A handle, closed at the end.
struct Exported {
    Exported(Context& context, const Buffer& buffer)
        : memory(context.memory().export_memory(buffer.range()).value()) {}
    ~Exported() { os::close(static_cast<os::Handle>(memory.handle)); }
    ExternalMemory memory;
};

TEST(ExternalMemory, IsOneForBothContexts) {
    const auto context = make_context();
    const auto other = make_context();
    auto first = exportable(*context, 4000);
    if (!first) return;
    EXPECT_OK(context->fill(first->range(), 7));
    const Exported exported(*context, *first);
    auto second = other->memory().import_memory(exported.memory, 4000, "imported");
    ASSERT_TRUE(second.ok()) << second.status().message();
    std::vector<std::uint32_t> words(1000);
    EXPECT_OK(other->read(second.value().range(), words.data(), 4000));
    EXPECT_EQ(words, std::vector<std::uint32_t>(1000, 7));
    EXPECT_OK(other->fill(second.value().range(), 9));
    EXPECT_OK(context->read(first->range(), words.data(), 4000));
    EXPECT_EQ(words, std::vector<std::uint32_t>(1000, 9));
    EXPECT_ERROR(other->memory().export_memory(second.value().range()), Code::kInvalidState,
                 "was imported itself");
}

TEST(ExternalMemory, TakesAPartOfTheMemory) {
    const auto context = make_context();
    const auto first = exportable(*context, 4096);
    if (!first) return;
    Exported exported(*context, *first);
    EXPECT_OK(context->fill(first->range(), 1));
    exported.memory.offset = 1024;
    {
        const auto part = context->memory().import_memory(exported.memory, 1024, "part");
        ASSERT_TRUE(part.ok()) << part.status().message();
        EXPECT_OK(context->fill(part.value().range(), 2));
    }
    std::vector<std::uint32_t> words(1024);
    EXPECT_OK(context->read(first->range(), words.data(), 4096));
    EXPECT_EQ(words[255], 1U);
    EXPECT_EQ(words[256], 2U);
    EXPECT_EQ(words[511], 2U);
    EXPECT_EQ(words[512], 1U);
}

TEST(ExternalMemory, CountsToTheBudgetUntilItIsFreed) {
    ContextDesc desc = context_desc();
    desc.memory.budget_bytes = 8192;
    desc.memory.block_bytes = 4096;
    const auto context = make_context(desc);
    {
        const auto first = exportable(*context, 4096);
        if (!first) return;
        const Exported exported(*context, *first);
        const auto second = context->memory().import_memory(exported.memory, 4096, "imported");
        EXPECT_OK(second);
        EXPECT_EQ(context->memory().use().live, 8192U);
        EXPECT_ERROR(context->memory().import_memory(exported.memory, 4096, "a third"),
                     Code::kOutOfDeviceMemory, "a third: needs");
    }
    EXPECT_EQ(context->memory().use().live, 0U);
    EXPECT_EQ(context->memory().use().used, 0U);
}

TEST(ExternalMemory, FailuresLeaveNoFileOpen) {
    const auto context = make_context();
    const auto first = exportable(*context, 4096);
    if (!first) return;
    const Exported exported(*context, *first);
    const std::size_t files = open_files();
    const auto refused = [&](const char* part, auto&& change) {
        ExternalMemory memory = exported.memory;
        change(memory);
        EXPECT_ERROR(context->memory().import_memory(memory, 4096, "imported"),
                     Code::kInvalidArgument, part);
    };
    refused("expected a multiple of", [](auto& memory) { memory.offset = 4; });
    refused("from byte 64 on", [](auto& memory) { memory.offset = 64; });
    refused("from byte 18446744073709551360 on", [](auto& memory) { memory.offset = ~0ULL - 255; });
    refused("has 4080 bytes, but", [](auto& memory) { memory.memory_bytes = 4080; });
    refused("the memory has the type 31", [](auto& memory) { memory.memory_type = 32; });
    refused("the memory has the type 4294967294", [](auto& memory) { memory.memory_type = ~0U; });
    refused("of another device: that has the UUID",
            [](auto& memory) { memory.device_uuid[15] ^= 1; });
    refused("of another driver: that has the UUID",
            [](auto& memory) { memory.driver_uuid[0] ^= 1; });
    refused("no open file descriptor", [](auto& memory) { memory.handle = -1; });
    refused("no open file descriptor", [](auto& memory) { memory.handle = 1 << 20; });
    refused("no open file descriptor",
            [](auto& memory) { memory.handle |= std::int64_t{1} << 32; });
#if SPLAT_FAULT_POINTS
    for (const char* point : {"vk.create_buffer", "vk.allocate_memory", "vk.map_memory"}) {
        fault::arm(point, 1, 1);
        const auto failed = context->memory().import_memory(exported.memory, 4096, "imported");
        const bool hit = fault::disarm() > 0;
        EXPECT_NE(failed.ok(), hit) << point;
        EXPECT_TRUE(hit || std::string_view(point) == "vk.map_memory") << point;  // discrete
    }
#endif
    EXPECT_EQ(open_files(), files);
    EXPECT_OK(context->memory().import_memory(exported.memory, 4096, "imported"));
    EXPECT_EQ(open_files(), files);
}

TEST(ExternalMemory, IsRefusedWhereTheDeviceHasNone) {
    ContextDesc desc = context_desc();
    desc.device.fake = [](DeviceInfo& info) { info.features.external_memory = false; };
    const auto context = make_context(desc);
    EXPECT_FALSE(exportable(*context, 4096).has_value());
    EXPECT_ERROR(context->memory().import_memory({}, 4096, "imported"), Code::kUnsupported,
                 "copy the elements by way of host memory");
    const auto plain = context->memory().allocate(64, MemoryKind::kDevice, "plain");
    EXPECT_ERROR(context->memory().export_memory(plain.value().range()), Code::kInvalidState,
                 "not made to be exported");
}

}  // namespace
}  // namespace splat::vk
