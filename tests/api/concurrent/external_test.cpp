// Tensors in memory that others open: by a second process, after their owner's end, from handles of anything else.
#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <numeric>

#include "api/api_calls.h"

namespace splat::test {
namespace {

constexpr std::int64_t kElements = 1000;
constexpr const char* kGiven = "SPLAT_TEST_EXTERNAL_MEMORY";

splat_tensor_desc exportable() {
    splat_tensor_desc desc = tensor_desc({kElements}, "shared");
    desc.flags = SPLAT_TENSOR_EXPORTABLE;
    return desc;
}

Floats counting(float first) {
    Floats values(kElements);
    std::iota(values.begin(), values.end(), first);
    return values;
}

splat_result import(splat_device device, const splat_external_memory& memory, Tensor& tensor) {
    const splat_tensor_desc desc = tensor_desc({kElements}, "imported");
    return splat_tensor_import(device, &desc, &memory, tensor.out());
}

/// A tensor that can be exported, with its memory. Without the feature only the refusal is tested.
class ApiExternal : public testing::Test {
  protected:
    void SetUp() override {
        const splat_tensor_desc desc = exportable();
        const auto info = got(splat_device_get_info, device_.get());
        if ((info.features & SPLAT_FEATURE_EXTERNAL_MEMORY) == 0) {
            EXPECT_REFUSED(splat_tensor_create(device_, &desc, tensor_.out()), kUnsupported,
                           "copy the elements");
            GTEST_SKIP() << "the device shares no memory";
        }
        ASSERT_DONE(splat_tensor_create(device_, &desc, tensor_.out()));
        EXPECT_EQ(download(tensor_), Floats(kElements, 0.0F));
        write(tensor_, counting(1));
        memory_ = got(splat_tensor_export, tensor_.get());
    }
    void TearDown() override { close_handle(); }
    void close_handle() {
        if (memory_.handle >= 0) ::close(static_cast<int>(memory_.handle));
        memory_.handle = -1;
    }

    Device device_ = open_device();
    Tensor tensor_;
    splat_external_memory memory_ = [] {
        auto memory = sized<splat_external_memory>();
        memory.handle = -1;
        return memory;
    }();
};

TEST_F(ApiExternal, IsWrittenByAnotherProcess) {
    const int inherited = ::dup(static_cast<int>(memory_.handle));  // not closed by exec
    std::string given = std::string(kGiven) + "=" + std::to_string(inherited) + " " +
                        std::to_string(memory_.memory_bytes) + " " +
                        std::to_string(memory_.memory_type);
    std::vector<char*> variables;
    for (char** each = environ; *each != nullptr; ++each) variables.push_back(*each);
    variables.push_back(given.data());
    variables.push_back(nullptr);
    std::string program = "api_threads_test", all = "--gtest_also_run_disabled_tests",
                filter = "--gtest_filter=ApiExternalChild.*";
    char* const arguments[] = {program.data(), all.data(), filter.data(), nullptr};
    pid_t child = 0;
    ASSERT_EQ(
        ::posix_spawn(&child, "/proc/self/exe", nullptr, nullptr, arguments, variables.data()), 0);
    int status = -1;
    ASSERT_EQ(::waitpid(child, &status, 0), child);
    ::close(inherited);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0) << status;
    EXPECT_EQ(download(tensor_), counting(5000));
}

/// The other process.
TEST(ApiExternalChild, DISABLED_ReadsAndWrites) {
    auto memory = sized<splat_external_memory>();
    const char* const given = std::getenv(kGiven);
    ASSERT_NE(given, nullptr);
    int handle = -1;
    unsigned long long bytes = 0;
    ASSERT_EQ(std::sscanf(given, "%d %llu %u", &handle, &bytes, &memory.memory_type), 3);
    memory.handle = handle;
    memory.memory_bytes = bytes;
    const Device device = open_device();
    Tensor tensor;
    ASSERT_DONE(import(device, memory, tensor));
    EXPECT_EQ(download(tensor), counting(1));
    write(tensor, counting(5000));
}

TEST_F(ApiExternal, OutlivesItsTensorItsDeviceAndTheHandle) {
    tensor_.destroy();
    device_.destroy();
    const Device other = open_device();
    Tensor imported;
    ASSERT_DONE(import(other, memory_, imported));
    close_handle();
    EXPECT_EQ(download(imported), counting(1));
    write(imported, counting(2));
    EXPECT_EQ(download(imported), counting(2));
    EXPECT_EQ(got(splat_tensor_check, imported.get()).max, 1001.0);
}

TEST_F(ApiExternal, OwnersMayFreeWhatOthersUse) {
    Tensor imported;
    ASSERT_DONE(import(device_, memory_, imported));
    tensor_.destroy();
    close_handle();
    const Tensor next = make_tensor(device_, {kElements});  // takes no memory of theirs
    write(next, counting(7));
    EXPECT_EQ(download(imported), counting(1));
    imported.destroy();
    EXPECT_EQ(download(next), counting(7));
}

TEST_F(ApiExternal, MappingsAndWritesAreSeenByBoth) {
    Tensor imported;
    ASSERT_DONE(import(device_, memory_, imported));
    mapped(imported, SPLAT_ACCESS_READ_WRITE)[3] = -1;
    ASSERT_DONE(splat_tensor_unmap(imported));
    EXPECT_EQ(download(tensor_)[3], -1.0F);
    write(tensor_, counting(3));
    EXPECT_EQ(download(imported), counting(3));
}

TEST_F(ApiExternal, RefusesHandlesOfOtherThings) {
    int ends[2] = {-1, -1};
    ASSERT_EQ(::pipe(ends), 0);
    const int null = ::open("/dev/null", O_RDWR);
    const int file = ::open("/proc/self/exe", O_RDONLY);
    const std::int64_t right = memory_.handle;
    Tensor imported;
    for (const int other : {ends[0], null, file}) {
        memory_.handle = other;
        EXPECT_REFUSED(import(device_, memory_, imported), kArgument, "handle");
        EXPECT_GE(::fcntl(other, F_GETFD), 0) << "the handle was closed";
    }
    for (const int each : {ends[0], ends[1], null, file}) ::close(each);
    for (const std::int64_t closed : {std::int64_t{file}, std::int64_t{-1}, INT64_MAX}) {
        memory_.handle = closed;
        EXPECT_REFUSED(import(device_, memory_, imported), kArgument, "no open file descriptor");
    }
    memory_.handle = right;
    EXPECT_DONE(import(device_, memory_, imported));
}

TEST_F(ApiExternal, RefusesOtherSizesDevicesAndStates) {
    Tensor imported;
    const auto refused = [&](const char* part, auto&& change) {
        splat_external_memory memory = memory_;
        change(memory);
        EXPECT_REFUSED(import(device_, memory, imported), kArgument, part);
    };
    refused("", [](auto& memory) { memory.memory_bytes += 1 << 20; });
    refused("bytes, but the elements need", [](auto& memory) { memory.memory_bytes = 3999; });
    refused("bytes, but the elements need", [](auto& memory) { memory.memory_bytes = 0; });
    refused("bytes, but the elements need", [](auto& memory) { memory.offset = 4096; });
    refused("expected a multiple", [](auto& memory) { memory.offset = 12; });
    refused("another", [](auto& memory) { memory.device_uuid[3] ^= 1; });
    refused("another", [](auto& memory) { memory.driver_uuid[3] ^= 1; });
    refused("type", [](auto& memory) { memory.memory_type = 33; });
    ASSERT_DONE(import(device_, memory_, imported));
    auto out = sized<splat_external_memory>();
    EXPECT_REFUSED(splat_tensor_export(imported, &out), kState, "imported");
    EXPECT_REFUSED(splat_tensor_export(make_tensor(device_, {1}), &out), kState, "exported");
    mapped(tensor_, SPLAT_ACCESS_READ);
    EXPECT_REFUSED(splat_tensor_export(tensor_, &out), kState, "mapped");
    EXPECT_EQ(out.handle, 0);
}

}  // namespace
}  // namespace splat::test
