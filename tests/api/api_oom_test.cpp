// Host memory runs out at each allocation that the library makes during one life of a device.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "api/host_memory.h"
#include "api/scenario/scenario.h"
#include "support/rng_fill.h"
#include "vk/context.h"

namespace splat::test {
namespace {

namespace fs = std::filesystem;

/// Watches every call. Derived classes decide what to do about failures.
class Watcher : public Observer {
  public:
    void before() override { host_memory::watch(); }
    void after() override { host_memory::unwatch(); }
};

/// Memory comes back after the first failing call, which is then repeated.
class Recovers : public Watcher {
  public:
    bool retry(const char* call, splat_result result) override {
        EXPECT_EQ(result, SPLAT_ERROR_OUT_OF_HOST_MEMORY)
            << call << ": " << splat_last_error_message();
        EXPECT_EQ(host_memory::failed(), 1U);
        host_memory::fail_none();
        told = true;
        return true;
    }

    bool told = false;
};

/// Memory does not come back: everything is destroyed without it.
class StaysAway : public Watcher {
  public:
    bool retry(const char* call, splat_result result) override {
        EXPECT_EQ(result, SPLAT_ERROR_OUT_OF_HOST_MEMORY)
            << call << ": " << splat_last_error_message();
        return false;
    }
};

using Life = std::optional<ScenarioResults> (*)(Observer&, const splat_device_desc&);

class ApiOom : public testing::Test {
  protected:
    explicit ApiOom(Life life = run_scenario) : life_(life) {}

    void SetUp() override {
        provoked_ = vk::validation_messages();
        listen_to_log(SPLAT_LOG_DEBUG);
        fail_with_long_text();
        undisturbed(true);
        for (int i = 0; i < 2; ++i) good_ = undisturbed();
        count_ = host_memory::seen();
        baseline_ = host_memory::live();
    }

    void TearDown() override { EXPECT_EQ(vk::validation_messages(), provoked_); }

    [[nodiscard]] splat_device_desc desc(bool validated = false) const {
        splat_device_desc desc = device_desc(SPLAT_DEVICE_PROFILE);
        if (validated) desc.flags |= SPLAT_DEVICE_VALIDATION;
        desc.kernels = SPLAT_KERNELS_PLAIN;
        desc.cache_folder = folder_.c_str();
        return desc;
    }

    /// A text longer than any later one, so that the buffer of the last error never grows again.
    static void fail_with_long_text() {
        host_memory::fail_none();
        const Device device = open_device();
        const std::string name(4000, 'n');
        auto desc = sized<splat_op_desc>();
        desc.type = name.c_str();
        splat_op op = nullptr;
        host_memory::watch();
        const splat_result result = splat_op_create(device, &desc, &op);
        host_memory::unwatch();
        EXPECT_EQ(result, kArgument);
    }

    ScenarioResults undisturbed(bool validated = false) {
        Watcher watcher;
        host_memory::fail_none();
        auto results = life_(watcher, desc(validated));
        EXPECT_TRUE(results.has_value());
        return results.value_or(ScenarioResults{});
    }

    /// Only the n-th allocation fails. The call reports it, and works when repeated.
    void fail_once(std::uint64_t n, bool validated) {
        SCOPED_TRACE("allocation " + std::to_string(n) + " fails once");
        Recovers observer;
        host_memory::fail(n, 1);
        const auto results = life_(observer, desc(validated));
        // An optional allocation (for the cache file, say) may fail silently.
        EXPECT_TRUE(observer.told || host_memory::failed() == 1 || fewer_than(n))
            << "nothing failed";
        EXPECT_TRUE(results.has_value() && *results == good_) << "the results differ";
        expect_clean();
    }

    /// The n-th allocation and all after it fail.
    void fail_from(std::uint64_t n, bool validated) {
        SCOPED_TRACE("allocations fail from " + std::to_string(n) + " on");
        StaysAway observer;
        host_memory::fail(n);
        const auto results = life_(observer, desc(validated));
        EXPECT_TRUE(host_memory::failed() > 0 || fewer_than(n)) << "nothing failed";
        injected_ += host_memory::failed();
        EXPECT_TRUE(!results || *results == good_) << "the results differ";
        expect_clean();
    }

    /// A run may be a little shorter than the counted one and end before the last allocations: threads in the
    /// background compile kernels that this thread else does, and other processes share the driver's shader cache. 25
    /// runs of one program made 7531 to 7692.
    bool fewer_than(std::uint64_t n) const {
        return host_memory::seen() < n && n + count_ / 25 >= count_;
    }

    void expect_clean() {
        host_memory::fail_none();
        EXPECT_EQ(host_memory::live(), baseline_) << "the library kept host memory";
        EXPECT_EQ(vk::validation_messages(), provoked_) << "Vulkan objects were left, see above";
        for (const auto& file : fs::directory_iterator(folder_.path())) {
            const fs::path kind = file.path().extension();
            EXPECT_TRUE(kind == ".bin" || kind == ".tested") << file << " was left behind";
        }
    }

    /// All allocations, or every `step`-th of them; every `validated_step`-th of these under the
    /// validation layer.
    void run(std::uint64_t step, std::uint64_t validated_step) {
        ASSERT_GT(count_, 500U) << "the library's allocations are not seen";
        std::uint64_t runs = 0;
        for (std::uint64_t n = 1; n <= count_; n += step) {
            const bool validated = runs++ % validated_step == validated_step - 1;
            fail_once(n, validated);
            fail_from(n, validated);
            if (HasFailure() && ++failures_ > 10) FAIL() << "and so on";
        }
        EXPECT_TRUE(undisturbed() == good_);
        std::printf(
            "%llu allocations per run, %llu of them failed, one after the other (once, and "
            "from there on): %llu injected in all\n",
            static_cast<unsigned long long>(count_), static_cast<unsigned long long>(runs),
            static_cast<unsigned long long>(injected_ + runs));
    }

    Life life_;
    const Temporary folder_;
    ScenarioResults good_;
    std::uint64_t count_ = 0;
    std::size_t baseline_ = 0;
    std::uint64_t provoked_ = 0;  ///< messages of the validation layer
    std::uint64_t injected_ = 0;
    int failures_ = 0;
};

TEST_F(ApiOom, SeesWhatIsLeftBehind) {
    host_memory::watch();
    auto left = std::make_unique<int>(1);
    host_memory::unwatch();
    EXPECT_EQ(host_memory::live(), baseline_ + 1);
    left.reset();
    EXPECT_EQ(host_memory::live(), baseline_);

    const std::uint64_t before = vk::validation_messages();
    EXPECT_DONE(splat_log_set_callback(nullptr, nullptr, 0));
    vk::ContextDesc wanted;
    wanted.device.validation = true;
    auto context = vk::Context::create(wanted);
    ASSERT_TRUE(context.ok());
    vk::Device& device = context.value()->device();
    VkFenceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    VkFence fence = VK_NULL_HANDLE;
    ASSERT_EQ(device.vk.vkCreateFence(device.handle(), &info, nullptr, &fence), VK_SUCCESS);
    context.value().reset();
    provoked_ = vk::validation_messages();
    EXPECT_GT(provoked_, before) << "a fence was left, and the validation layer did not report it";
    listen_to_log();
}

/// Rows are gathered or stay, whichever allocation fails.
TEST_F(ApiOom, SparesRowsThatAreNotGathered) {
    const Device device = open_device(SPLAT_DEVICE_PROFILE);  // a list that ran stays done, too
    const Floats values = normal_fill(24, 1);
    const Tensor value = upload(device, {3, 8}, values);
    const Tensor grad = upload(device, {3, 8}, normal_fill(24, 2));
    const splat_optimizer_item item = {"rows", nullptr, nullptr, value, grad};
    splat_optimizer_desc desc = optimizer_desc(&item);
    desc.ema_decay = 0.9;
    const Optimizer optimizer = got(splat_optimizer_create, device, &desc);
    const auto gather = [&](const std::vector<std::int64_t>& rows) {
        host_memory::watch();
        const splat_result result =
            splat_optimizer_gather_rows(optimizer, "rows", rows.data(), rows.size());
        host_memory::unwatch();
        return result;
    };
    Floats gathered(values.begin() + 16, values.end());
    gathered.insert(gathered.end(), values.begin(), values.begin() + 8);
    std::uint64_t n = 0;
    for (bool failed = true; failed && !HasFailure();) {
        SCOPED_TRACE("allocation " + std::to_string(++n) + " fails");
        write(value, values);
        host_memory::fail(n, 1);
        const splat_result result = gather({2, 0});
        failed = host_memory::failed() > 0;
        host_memory::fail_none();
        if (result != SPLAT_OK) {
            EXPECT_EQ(result, SPLAT_ERROR_OUT_OF_HOST_MEMORY) << splat_last_error_message();
            EXPECT_EQ(download(value), values);
            EXPECT_DONE(gather({2, 0}));
        }
        Floats found = download(value);
        found.resize(16);
        EXPECT_EQ(found, gathered);
        EXPECT_DONE(splat_optimizer_step(optimizer, nullptr));
        EXPECT_DONE(gather({0, 1, -1}));
    }
    EXPECT_GT(n, 20U) << "the library's allocations are not seen";
}

TEST_F(ApiOom, SomeAllocations) {
    run(count_ / 60, 20);
}

TEST_F(ApiOom, EveryAllocation) {
    run(1, 25);
}

/// The same with scenes, files and the rasterizer.
class ApiOomRaster : public ApiOom {
  protected:
    ApiOomRaster() : ApiOom(run_raster_scenario) {}
};

TEST_F(ApiOomRaster, SomeAllocations) {
    run(count_ / 100, 50);
}

TEST_F(ApiOomRaster, EveryAllocation) {
    run(1, 50);
}

/// The same with a network in training.
class ApiOomTrain : public ApiOom {
  protected:
    ApiOomTrain() : ApiOom(run_train_scenario) {}
};

TEST_F(ApiOomTrain, SomeAllocations) {
    run(count_ / 12, 6);
}

/// All of them would take a day.
TEST_F(ApiOomTrain, ManyAllocations) {
    run(count_ / 400, 50);
}

}  // namespace
}  // namespace splat::test
