// Drivers that refuse kernels, lose the device, hang, lie about their lanes, or end the process: plain kernels run
// instead, of the family alone, and the next device knows.
#include "self_test/self_test.h"

#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "core/environment.h"
#include "self_test/notes.h"
#include "self_test/parts.h"
#include "splat.h"
#include "support/expect_status.h"
#include "support/gpu_env.h"
#include "support/system.h"
#include "vk/shaders.h"

namespace splat::self_test {
namespace {

namespace fs = std::filesystem;
using vk::Family;
using vk::Kernels;

VolkDeviceTable g_good;
std::atomic<int> g_failures{0};  ///< calls still to fail

bool fails() {
    return g_failures.load() > 0 && g_failures.fetch_sub(1) > 0;
}

VKAPI_ATTR VkResult VKAPI_CALL refuse_fast(VkDevice device, const VkShaderModuleCreateInfo* info,
                                           const VkAllocationCallbacks* callbacks,
                                           VkShaderModule* made) {
    for (const vk::ShaderModule& module : vk::shader_modules()) {
        const std::string_view name = module.name;
        if (module.words.data() == info->pCode &&
            (name.ends_with("_cpu") || name.ends_with("_gpu")))
            return VK_ERROR_UNKNOWN;
    }
    return g_good.vkCreateShaderModule(device, info, callbacks, made);
}

VKAPI_ATTR VkResult VKAPI_CALL lose(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos,
                                    VkFence fence) {
    return fails() ? VK_ERROR_DEVICE_LOST : g_good.vkQueueSubmit(queue, count, infos, fence);
}

/// Takes no time, so that the 60 s of a timeout pass at once.
VKAPI_ATTR VkResult VKAPI_CALL hang(VkDevice, std::uint32_t, const VkFence*, VkBool32,
                                    std::uint64_t) {
    return VK_TIMEOUT;
}

class SelfTest : public testing::Test {
  protected:
    void SetUp() override {
        kernels_ = environment("SPLAT_KERNELS");
        test::unset_variable("SPLAT_KERNELS");
        desc_ = test::context_desc();
        desc_.device.validation = false;  // what drivers do here it would rightly report
        desc_.cache_folder = folder_.string();
        fs::remove_all(folder_);
        const std::string driver = testing::UnitTest::GetInstance()->current_test_info()->name();
        desc_.device.fake = [driver](vk::DeviceInfo& info) { info.driver = driver; };
    }
    void TearDown() override {
        g_failures = 0;
        fs::remove_all(folder_);
        if (kernels_) test::set_variable("SPLAT_KERNELS", *kernels_);
    }

    void open() {
        tests_ = {};
        context_ = need(create_context(desc_, tests_));
        g_good = context_->device().vk;
    }
    [[nodiscard]] Status ask(unsigned families) {
        return test_kernels(*context_, tests_, families);
    }
    [[nodiscard]] Kernels kernels(Family family) const {
        return context_->device().kernels(family);
    }
    /// What `vkrun devices` says.
    [[nodiscard]] std::string told() const {
        vk::DeviceInfo info = context_->device().info();
        return leave_out_failed(info, tests_.notes);
    }
    void expect_told(const std::string& part) const {
        EXPECT_NE(told().find(part), std::string::npos) << told();
    }

    std::optional<std::string> kernels_;
    const fs::path folder_ =
        fs::temp_directory_path() / ("splat-self-test-" + test::process_text());
    vk::ContextDesc desc_;
    KernelTests tests_;
    std::shared_ptr<vk::Context> context_;
};

TEST_F(SelfTest, RefusedKernelsAreReplacedInTheirFamilyAlone) {
    open();
    if (kernels(Family::kNetwork) == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    const Kernels best = kernels(Family::kNetwork);
    context_->device().vk.vkCreateShaderModule = refuse_fast;
    EXPECT_OK(ask(kNetworkKernels));
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain);
    EXPECT_EQ(kernels(Family::kSort), best);
    expect_told("(network): a product of matrices fails: vkCreateShaderModule of ");
    EXPECT_OK(ask(kAllKernels));
    EXPECT_EQ(kernels(Family::kSort), Kernels::kPlain);
    open();
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain) << "the next device knows";
}

TEST_F(SelfTest, FailedKernelsThatWereChosenAreAnError) {
    desc_.device.kernels = Kernels::kGpu;
    if (test::kernels_to_test().size() == 1) GTEST_SKIP() << "only plain kernels";
    open();
    context_->device().vk.vkCreateShaderModule = refuse_fast;
    EXPECT_ERROR(ask(kNetworkKernels), Code::kInternal, "vkCreateShaderModule of ");
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kGpu);
}

TEST_F(SelfTest, ALostDeviceIsOpenedAnew) {
    open();
    const Kernels best = kernels(Family::kNetwork);
    if (best == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    context_->device().vk.vkQueueSubmit = lose;
    g_failures = 1;
    EXPECT_OK(ask(kNetworkKernels | kRasterKernels));
    EXPECT_OK(context_->device().alive());
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain);
    EXPECT_EQ(kernels(Family::kSort), best);
    expect_told("was lost");
}

TEST_F(SelfTest, ALostDeviceWithDataIsNotOpenedAnew) {
    open();
    if (kernels(Family::kNetwork) == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    vk::Buffer data = need(context_->memory().allocate(64, vk::MemoryKind::kDevice, "data"));
    context_->device().vk.vkQueueSubmit = lose;
    g_failures = 1;
    EXPECT_ERROR(ask(kNetworkKernels), Code::kDeviceLost, "open the device again");
    data = {};
    open();
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain);
}

TEST_F(SelfTest, ATestThatNeverEndsIsOver) {
    open();
    const Kernels best = kernels(Family::kNetwork);
    if (best == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    context_->device().vk.vkWaitForFences = hang;
    EXPECT_OK(ask(kRasterKernels));
    EXPECT_EQ(kernels(Family::kNetwork), best);
    EXPECT_EQ(kernels(Family::kSort), Kernels::kPlain);
    expect_told("did not finish within");
}

TEST_F(SelfTest, AShortTimeoutBlamesNoKernels) {
    desc_.timeout_ns = 1000000;
    open();
    const Kernels best = kernels(Family::kSort);
    context_->device().vk.vkWaitForFences = hang;
    EXPECT_ERROR(ask(kRasterKernels), Code::kTimeout, "did not finish");
    EXPECT_EQ(kernels(Family::kSort), best);
    EXPECT_EQ(told(), "");
    context_->device().vk.vkWaitForFences = g_good.vkWaitForFences;
}

/// The order of a sort's entries and the sums of blending are found wrong, and only these are replaced.
TEST_F(SelfTest, LanesThatAreFewerThanToldAreFound) {
    const auto named = desc_.device.fake;
    desc_.device.fake = [named](vk::DeviceInfo& info) {
        named(info);
        info.kind = vk::DeviceKind::kDiscrete;
        info.limits.least_lanes = 4 * info.limits.subgroup_size;
    };
    open();
    if (kernels(Family::kNetwork) == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    EXPECT_EQ(kernels(Family::kSort), Kernels::kGpu);
    EXPECT_OK(ask(kAllKernels));
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kGpu);
    EXPECT_EQ(kernels(Family::kSort), Kernels::kPlain);
    EXPECT_EQ(kernels(Family::kBlend), Kernels::kPlain);
    expect_told("(sort): a sort of 5,000 keys is off by");
}

TEST_F(SelfTest, ATestThatEndedItsProcessIsRemembered) {
    SPLAT_NEED_FORK();
    open();
    const Kernels best = kernels(Family::kNetwork);
    if (best == Kernels::kPlain) GTEST_SKIP() << "only plain kernels";
    const vk::DeviceInfo& info = context_->device().info();
    const std::string key = format("%d.%d.%d %s %u %s %s network", SPLAT_VERSION_MAJOR,
                                   SPLAT_VERSION_MINOR, SPLAT_VERSION_PATCH, info.driver.c_str(),
                                   info.driver_version, info.name.c_str(), vk::kernels_name(best));
    {
        const Testing running(tests_.notes, {key});
        EXPECT_TRUE(fs::exists(tests_.notes + ".testing"));
        EXPECT_EQ(told(), "") << "another one's test";
    }
    EXPECT_FALSE(fs::exists(tests_.notes + ".testing")) << "a test that ended";
    const auto crash = [&] {
        EXPECT_EQ(test::in_child([&] {
                      static const Testing crashes(tests_.notes, {key});  // until the end
                      return 0;
                  }),
                  0);
        EXPECT_TRUE(fs::exists(tests_.notes + ".testing"));
    };
    const auto noted = [&] {
        std::ostringstream text;
        text << std::ifstream(tests_.notes).rdbuf();
        return text.str();
    };
    crash();
    for (int again = 0; again < 2; ++again)
        expect_told("(network): a process ended while it tested them");
    EXPECT_EQ(noted(), "") << "whoever only asks decides nothing";
    open();
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain);
    EXPECT_EQ(noted(), "suspect " + key + ".\n") << "another process tests them once more";
    EXPECT_FALSE(fs::exists(tests_.notes + ".testing"));
    crash();
    open();
    EXPECT_HAS(noted(), "failed " + key + ": a process ended while it tested them, twice");
    EXPECT_EQ(kernels(Family::kNetwork), Kernels::kPlain);
    EXPECT_OK(ask(kNetworkKernels));
    test::set_variable("SPLAT_SELF_TEST", "0");
    open();
    test::unset_variable("SPLAT_SELF_TEST");
    EXPECT_EQ(kernels(Family::kNetwork), best);
}

/// A family is replaced while the others stay: every mix draws and computes.
TEST_F(SelfTest, AnyMixOfKernelsIsRight) {
    for (const Kernels all : test::kernels_to_test())
        for (const Family plain : vk::kFamilies) {
            if (all == Kernels::kPlain && plain != Family::kNetwork) continue;
            SCOPED_TRACE(std::string(vk::kernels_name(all)) + " but " + vk::family_name(plain));
            desc_.device.kernels = all;
            open();
            context_->device().use_plain_kernels(plain);
            EXPECT_EQ(need(sort_error(*context_)), 0);
            EXPECT_EQ(need(convolution_error(*context_)), 0);
            for (const auto error : {raster_error, raster_gradient_error, raster_list_error,
                                     raster_list_gradient_error})
                EXPECT_LT(need(error(*context_)), 5e-3);
        }
}

}  // namespace
}  // namespace splat::self_test
