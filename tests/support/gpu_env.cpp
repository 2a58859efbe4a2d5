#include "support/gpu_env.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <map>

#include "core/environment.h"
#include "core/log.h"
#include "support/expect_status.h"
#include "support/gpu_buffers.h"
#include "support/require_vulkan.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using vk::Context;
using vk::Kernels;

/// A context with a small buffer that keeps its first block of memory, so that the block's contents
/// stay.
struct Poisoned {
    std::shared_ptr<Context> context;
    vk::Buffer anchor;
};

struct Registry {
    std::map<Kernels, std::shared_ptr<Context>> shared;
    std::map<Kernels, Poisoned> poisoned;
    std::vector<std::weak_ptr<Context>> open;
    std::uint64_t expected_messages = 0;
    bool quiet = false;  // inside ExpectedMessages
};

Registry& registry() {
    static Registry instance;
    return instance;
}

void print_validation(void*, int level, const char* message) {
    const bool validation = std::strncmp(message, "[validation]", 12) == 0;
    if (registry().quiet && validation) return;
    if (validation || level >= static_cast<int>(LogLevel::kError))
        std::fprintf(stderr, "%s\n", message);
}

void expect_guards_whole(Context& context) {
    EXPECT_OK(context.memory().check_guards());
}

/// A copy that reads what a fill wrote, without the barrier between them.
Status record_hazard(Context& context) {
    SPLAT_ASSIGN(const vk::Buffer from,
                 context.memory().allocate(256, vk::MemoryKind::kDevice, "bait source"));
    SPLAT_ASSIGN(const vk::Buffer to,
                 context.memory().allocate(256, vk::MemoryKind::kDevice, "bait target"));
    vk::Recorder recorder(context);
    recorder.omit_barriers = true;
    SPLAT_TRY(recorder.fill(from.range(), 1));
    SPLAT_TRY(recorder.copy(from.range(), to.range()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    return context.run(list);
}

Result<std::shared_ptr<Context>> open_context(const vk::ContextDesc& desc) {
    SPLAT_ASSIGN(std::shared_ptr<Context> inner, Context::create(desc));
    Context* raw = inner.get();
    std::shared_ptr<Context> context(raw, [inner = std::move(inner)](Context* closing) mutable {
        expect_guards_whole(*closing);
        inner.reset();
    });
    registry().open.push_back(context);
    return context;
}

/// kNoDevice without a Vulkan loader, a driver or a usable device.
Status find_device() {
    vk::DeviceDesc desc;
    desc.validation = validation_on();
    return vk::Device::create(desc).status();
}

class GpuEnvironment : public testing::Environment {
  public:
    void SetUp() override {
        set_log_sink(print_validation, nullptr, LogLevel::kWarning);
        if (!vulkan_required()) {
            const Status status = find_device();
            if (status.code() == Code::kNoDevice)
                GTEST_SKIP() << "[ device   ] none, so nothing is tested: " << status.message();
        }
        Context* context = shared_context();
        ASSERT_NE(context, nullptr)
            << (vulkan_required() ? "SPLAT_REQUIRE_VULKAN is set, so a missing device is a failure"
                                  : "");
        const vk::DeviceInfo& info = context->device().info();
        std::printf("[ device   ] %s, %s\n", info.name.c_str(), info.driver.c_str());
        if (!validation_on()) {
            std::printf("[ layers   ] validation is OFF (SPLAT_TEST_VALIDATION=0)\n");
            return;
        }
        const ExpectedMessages bait;
        ASSERT_OK(record_hazard(*context));
        ASSERT_GT(bait.count(), 0U)
            << "the validation layer is loaded, but did not report a hazard made on purpose; is "
               "VK_LAYER_ENABLES or vk_layer_settings.txt overriding its features?";
        std::printf("[ layers   ] validation is on; the bait hazard was reported\n");
    }

    void TearDown() override {
        const std::uint64_t before = vk::validation_messages();
        close_shared_contexts();
        EXPECT_EQ(vk::validation_messages(), before) << "messages while closing the device";
        set_log_sink(nullptr, nullptr, LogLevel::kError);
    }
};

class GpuListener : public testing::EmptyTestEventListener {
  public:
    void OnTestStart(const testing::TestInfo&) override {
        set_log_sink(print_validation, nullptr, LogLevel::kWarning);  // a LogCapture took it
        messages_ = vk::validation_messages();
        registry().expected_messages = 0;
    }

    void OnTestEnd(const testing::TestInfo&) override {
        Registry& all = registry();
        for (const auto& weak : all.open)
            if (const auto context = weak.lock()) expect_guards_whole(*context);
        std::erase_if(all.open, [](const auto& weak) { return weak.expired(); });
        const std::uint64_t messages = vk::validation_messages() - messages_;
        EXPECT_EQ(messages, all.expected_messages)
            << "the validation layer reported messages during this test; see above";
    }

  private:
    std::uint64_t messages_ = 0;
};

}  // namespace

bool validation_on() {
    return environment("SPLAT_TEST_VALIDATION").value_or("1") != "0";
}

vk::ContextDesc context_desc(Kernels kernels, Bounds bounds) {
    vk::ContextDesc desc;
    desc.device.kernels = kernels;
    desc.device.validation = validation_on();
    desc.memory.guard = bounds == Bounds::kGuards;
    if (bounds == Bounds::kExact) desc.memory.block_bytes = 1;  // no two allocations in one block
    desc.memory.poison = kPoisonPatterns[1];
    desc.memory.hide_host = environment("SPLAT_TEST_DISCRETE").value_or("0") != "0";
    return desc;
}

std::shared_ptr<Context> make_context(const vk::ContextDesc& desc) {
    return need(open_context(desc));
}

Context* shared_context(Kernels kernels) {
    std::shared_ptr<Context>& slot = registry().shared[kernels];
    const Bounds bounds = validation_on() ? Bounds::kExact : Bounds::kGuards;
    if (slot == nullptr) {
        auto opened = open_context(context_desc(kernels, bounds));
        EXPECT_OK(opened);
        if (opened.ok()) slot = std::move(opened.value());
    }
    return slot.get();
}

Context* poisoned_context(Kernels kernels, std::uint32_t pattern) {
    constexpr std::uint64_t kBlock = std::uint64_t{16} << 20;
    Poisoned& slot = registry().poisoned[kernels];
    if (slot.context == nullptr) {
        vk::ContextDesc desc = context_desc(kernels, Bounds::kGuards);
        desc.memory.poison.reset();
        desc.memory.block_bytes = kBlock;
        slot.context = make_context(desc);
        slot.anchor = device_buffer(*slot.context, 4);
    }
    const vk::Buffer rest = device_buffer(*slot.context, (kBlock - 4096) / 4);
    EXPECT_OK(slot.context->fill(rest.range(), pattern));
    EXPECT_EQ(slot.context->memory().use().allocations, 1U);
    return slot.context.get();
}

void close_shared_contexts() {
    for (auto& [kernels, slot] : registry().poisoned) slot.anchor = vk::Buffer();
    registry().poisoned.clear();
    registry().shared.clear();
}

std::vector<Kernels> kernels_to_test() {
    Context* context = shared_context();
    if (context == nullptr) return {};
    if (std::ranges::count(context->device().info().kernels, Kernels::kPlain) > 0)
        return {Kernels::kPlain};
    if (!context->device().info().features.int64) return {Kernels::kPlain, Kernels::kGpu};
    return {Kernels::kPlain, Kernels::kCpu, Kernels::kGpu};
}

ExpectedMessages::ExpectedMessages() : start_(vk::validation_messages()) {
    registry().quiet = true;
}

ExpectedMessages::~ExpectedMessages() {
    registry().quiet = false;
    registry().expected_messages += count();
}

std::uint64_t ExpectedMessages::count() const {
    return vk::validation_messages() - start_;
}

void install_gpu_environment() {
    testing::AddGlobalTestEnvironment(new GpuEnvironment);  // gtest owns both
    // Ends are announced in reverse order, so failures found at a test's end are printed under that
    // test.
    testing::UnitTest::GetInstance()->listeners().Append(new GpuListener);
}

}  // namespace splat::test
