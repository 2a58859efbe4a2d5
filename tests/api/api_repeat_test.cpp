// A thousand lives of a device leave no memory behind.
#include <malloc.h>
#include <unistd.h>

#include <cstdio>
#include <fstream>

#include "api/scenario/scenario.h"

namespace splat::test {
namespace {

constexpr int kWarmUp = 100;
constexpr int kLives = 1000;
constexpr double kMostGrowth = 2.0;  // MB, over that of the driver

double resident_megabytes() {
    malloc_trim(0);
    std::ifstream file("/proc/self/statm");
    std::size_t total = 0;
    std::size_t resident = 0;
    file >> total >> resident;
    return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1e6;
}

/// Growth of the process over kLives calls, after a warm-up.
template <class Life>
double growth(Life&& life) {
    for (int i = 0; i < kWarmUp; ++i) life();
    const double before = resident_megabytes();
    for (int i = 0; i < kLives; ++i) life();
    return resident_megabytes() - before;
}

splat_device_desc plain_desc() {
    splat_device_desc desc = device_desc();
    desc.kernels = SPLAT_KERNELS_PLAIN;
    return desc;
}

TEST(ApiRepeat, LivesLeaveNothing) {
    const double driver = growth([] { open_device(plain_desc()); });
    Observer observer;
    const auto expected = run_scenario(observer, plain_desc());
    ASSERT_TRUE(expected.has_value());
    const double library = growth([&] {
        const auto results = run_scenario(observer, plain_desc());
        EXPECT_TRUE(results.has_value() && *results == *expected);
    });
    std::printf("%d lives: %.2f MB more, of which %.2f MB for opening and closing alone\n", kLives,
                library, driver);
    EXPECT_LT(library - std::max(driver, 0.0), kMostGrowth);
}

TEST(ApiRepeat, CountersReturnToZero) {
    const Device device = open_device(plain_desc());
    const double library = growth([&device] {
        const Tensor x = upload(device, {2, 4}, {1, 2, 3, 4, 5, 6, 7, 8});
        const Tensor weight = upload(device, {1, 4}, {1, 1, 1, 1});
        const Tensor y = make_tensor(device, {2, 1});
        const Op op = make_op(device, OpRequest("linear", {x, weight, nullptr}, {y}));
        EXPECT_DONE(splat_op_forward(op));
        EXPECT_EQ(download(y), (Floats{10, 26}));
    });
    const auto memory = got(splat_device_get_memory, device);
    EXPECT_EQ(memory.allocations, 0U);
    EXPECT_EQ(memory.used_bytes, 0U);
    EXPECT_EQ(memory.live_bytes, 0U);
    std::printf("%d operators on one device: %.2f MB more\n", kLives, library);
    EXPECT_LT(library, kMostGrowth);
}

}  // namespace
}  // namespace splat::test
