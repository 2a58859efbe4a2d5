// Effects of the environment on the library. Each case needs the variables of its ctest entry.
#include <cstdlib>

#include "api/api_calls.h"
#include "core/os/drivers.h"

namespace splat::test {
namespace {

/// The value that ctest set, or a failure that says so.
std::string required(const char* variable) {
    const char* const value = std::getenv(variable);
    if (value != nullptr) return value;
    ADD_FAILURE() << variable << " is not set: run this case through ctest (tests/api)";
    return {};
}

/// Creation fails, and the text has all of `parts`.
void expect_create_refused(splat_result code, std::initializer_list<const char*> parts) {
    const splat_device_desc desc = device_desc();
    Output<splat_device> device;
    for (int i = 0; i < 2; ++i)
        for (const char* part : parts)
            EXPECT_REFUSED(splat_device_create(&desc, device.out()), code, part);
    EXPECT_REFUSED(splat_device_create(nullptr, device.out()), code, *parts.begin());
    EXPECT_TRUE(device.untouched());
}

void expect_describe_refused(splat_result code, const char* part) {
    Output<splat_device_info> info;
    info.set_struct_size(sizeof(splat_device_info));
    EXPECT_REFUSED(splat_device_describe(0, info.out()), code, part);
    EXPECT_TRUE(info.untouched());
}

void expect_the_rest_to_work() {
    EXPECT_EQ(splat_version(), SPLAT_VERSION);
    EXPECT_GT(std::strlen(splat_build_info()), 10U);
    EXPECT_FALSE(text_of(splat_op_list).empty());
    EXPECT_FALSE(text_of(splat_scene_formats).empty());
}

TEST(ApiNoLoader, IsNoDeviceAndNamesThePackage) {
    required("LD_LIBRARY_PATH");
    Output<std::uint32_t> count;
    EXPECT_REFUSED(splat_device_count(count.out()), SPLAT_ERROR_NO_DEVICE, "libvulkan.so.1");
    EXPECT_REFUSED(splat_device_count(count.out()), SPLAT_ERROR_NO_DEVICE, "libvulkan1");
    EXPECT_TRUE(count.untouched());
    expect_describe_refused(SPLAT_ERROR_NO_DEVICE, "libvulkan1");
    expect_create_refused(SPLAT_ERROR_NO_DEVICE, {"libvulkan.so.1", "apt-get install libvulkan1"});
    expect_the_rest_to_work();
}

TEST(ApiNoDriver, IsNoDeviceAndNamesThePackage) {
    required("SPLAT_TEST_NO_DRIVER");
    const std::string remedy = os::install_driver();
    Output<std::uint32_t> count;
    EXPECT_REFUSED(splat_device_count(count.out()), SPLAT_ERROR_NO_DEVICE, remedy.c_str());
    EXPECT_TRUE(count.untouched());
    expect_describe_refused(SPLAT_ERROR_NO_DEVICE, remedy.c_str());
    expect_create_refused(SPLAT_ERROR_NO_DEVICE, {remedy.c_str(), "driver"});
    expect_the_rest_to_work();
}

TEST(ApiBadKernels, IsRefusedByName) {
    const std::string value = required("SPLAT_KERNELS");
    expect_create_refused(kArgument, {"SPLAT_KERNELS", value.c_str(), "plain, cpu or gpu"});
    std::uint32_t count = 0;
    EXPECT_DONE(splat_device_count(&count));
    expect_the_rest_to_work();
}

TEST(ApiBadTimeoutScale, IsRefusedByName) {
    const std::string value = required("SPLAT_TIMEOUT_SCALE");
    expect_create_refused(kArgument, {"SPLAT_TIMEOUT_SCALE", value.c_str()});
    expect_the_rest_to_work();
}

TEST(ApiKernels, OverrideTheDesc) {
    const std::string value = required("SPLAT_KERNELS");
    const splat_kernels expected = value == "plain" ? SPLAT_KERNELS_PLAIN
                                   : value == "cpu" ? SPLAT_KERNELS_CPU
                                                    : SPLAT_KERNELS_GPU;
    for (const splat_kernels wish : {SPLAT_KERNELS_AUTO, SPLAT_KERNELS_PLAIN, SPLAT_KERNELS_GPU}) {
        splat_device_desc desc = device_desc();
        desc.kernels = wish;
        const Device device = open_device(desc);
        const auto info = got(splat_device_get_info, device);
        EXPECT_EQ(info.kernels, expected);
    }
    const Tensor x = upload(shared_device(), {2, 4}, {1, 2, 3, 4, 5, 6, 7, 8});
    const Tensor weight = upload(shared_device(), {1, 4}, {1, 1, 1, 1});
    const Tensor y = make_tensor(shared_device(), {2, 1});
    const Op op = make_op(shared_device(), OpRequest("linear", {x, weight, nullptr}, {y}));
    EXPECT_DONE(splat_op_forward(op));
    EXPECT_EQ(download(y), (Floats{10, 26}));
}

}  // namespace
}  // namespace splat::test
