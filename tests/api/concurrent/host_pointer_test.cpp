// Pointers into tensors, and DLPack.
#include <thread>

#include "api/concurrent/long_call.h"
#include "support/require_vulkan.h"

// A consumer defines them like this, from the DLPack specification (dlpack.h, ABI version 1.x).
extern "C" {
typedef struct {
    uint32_t major, minor;
} TestDLPackVersion;
typedef struct {
    void* data;
    struct {
        int32_t device_type, device_id;
    } device;
    int32_t ndim;
    struct {
        uint8_t code, bits;
        uint16_t lanes;
    } dtype;
    int64_t* shape;
    int64_t* strides;
    uint64_t byte_offset;
} TestDLTensor;
struct DLManagedTensorVersioned {
    TestDLPackVersion version;
    void* manager_ctx;
    void (*deleter)(struct DLManagedTensorVersioned* self);
    uint64_t flags;
    TestDLTensor dl_tensor;
};
}

namespace splat::test {
namespace {

bool unified(splat_device device) {
    const auto info = got(splat_device_get_info, device);
    return (info.features & SPLAT_FEATURE_UNIFIED_MEMORY) != 0;
}

TEST(ApiHostPointer, IsStableAndSeesWhatCallsWrite) {
    const splat_device device = shared_device();
    if (!unified(device)) SPLAT_SKIP_FOR_DEVICE("the device's memory is not unified");
    const Tensor x = upload(device, {2, 2}, {-1, 1, 2, 3}), y = make_tensor(device, {2, 2});
    void* in = nullptr;
    void* out = nullptr;
    std::size_t bytes = 0;
    ASSERT_DONE(splat_tensor_host_pointer(x, &in, &bytes));
    EXPECT_EQ(bytes, 16U);
    ASSERT_DONE(splat_tensor_host_pointer(y, &out, nullptr));
    const Op op = make_op(device, OpRequest("relu", {x}, {y}));
    const auto* const results = static_cast<const float*>(out);
    ASSERT_DONE(splat_op_forward(op));
    EXPECT_EQ(results[0], 0);
    EXPECT_EQ(results[3], 3);
    static_cast<float*>(in)[0] = 7;
    ASSERT_DONE(splat_op_forward(op));
    EXPECT_EQ(results[0], 7);
    void* again = nullptr;
    ASSERT_DONE(splat_tensor_host_pointer(x, &again, nullptr));
    EXPECT_EQ(again, in);
    Output<DLManagedTensorVersioned*> managed;
    ASSERT_DONE(splat_tensor_map(x, SPLAT_ACCESS_READ, &again, nullptr));
    EXPECT_REFUSED(splat_tensor_host_pointer(x, &out, nullptr), kState, "is mapped");
    EXPECT_REFUSED(splat_tensor_to_dlpack(x, managed.out()), kState, "is mapped");
    EXPECT_TRUE(managed.untouched() && out == results);
    EXPECT_DONE(splat_tensor_unmap(x));
}

TEST(ApiDlpack, DescribesTheTensorAndOutlivesIt) {
    const splat_device device = shared_device();
    if (!unified(device)) SPLAT_SKIP_FOR_DEVICE("the device's memory is not unified");
    Tensor tensor = upload(device, {2, 3}, {1, 2, 3, 4, 5, 6});
    DLManagedTensorVersioned* shared = nullptr;
    ASSERT_DONE(splat_tensor_to_dlpack(tensor, &shared));
    tensor.destroy();
    EXPECT_EQ(shared->version.major, 1U);
    EXPECT_EQ(shared->flags, 0U);
    const TestDLTensor& seen = shared->dl_tensor;
    EXPECT_EQ(seen.device.device_type, 1) << "kDLCPU";
    EXPECT_EQ(seen.dtype.code, 2) << "kDLFloat";
    EXPECT_EQ(seen.dtype.bits, 32);
    EXPECT_EQ(seen.dtype.lanes, 1);
    EXPECT_EQ(seen.byte_offset, 0U);
    ASSERT_EQ(seen.ndim, 2);
    EXPECT_EQ(seen.shape[0], 2);
    EXPECT_EQ(seen.shape[1], 3);
    EXPECT_EQ(seen.strides[0], 3);
    EXPECT_EQ(seen.strides[1], 1);
    const auto* const values = static_cast<const float*>(seen.data);
    EXPECT_EQ(Floats(values, values + 6), (Floats{1, 2, 3, 4, 5, 6}));
    auto before = sized<splat_memory_info>(), after = before;
    EXPECT_DONE(splat_device_get_memory(device, &before));
    shared->deleter(shared);
    EXPECT_DONE(splat_device_get_memory(device, &after));
    EXPECT_LT(after.live_bytes, before.live_bytes);
}

TEST(ApiDlpack, NamesIntegersAndScalars) {
    const splat_device device = shared_device();
    if (!unified(device)) SPLAT_SKIP_FOR_DEVICE("the device's memory is not unified");
    const std::pair<splat_dtype, int> types[] = {{SPLAT_DTYPE_I32, 0}, {SPLAT_DTYPE_U32, 1}};
    for (const auto& [dtype, code] : types) {
        const Tensor tensor = make_tensor(device, {}, "scalar", dtype);
        DLManagedTensorVersioned* shared = nullptr;
        ASSERT_DONE(splat_tensor_to_dlpack(tensor, &shared));
        EXPECT_EQ(shared->dl_tensor.dtype.code, code);
        EXPECT_EQ(shared->dl_tensor.ndim, 0);
        shared->deleter(shared);
    }
}

/// Another thread may delete it, beside a call on the device and after the device's end.
TEST(ApiDlpack, DeleterDoesNotWait) {
    Device device = open_device();
    if (!unified(device)) SPLAT_SKIP_FOR_DEVICE("the device's memory is not unified");
    DLManagedTensorVersioned* shared[2] = {};
    {
        const Tensor tensor = upload(device, {4}, {1, 2, 3, 4});
        for (auto*& one : shared) ASSERT_DONE(splat_tensor_to_dlpack(tensor, &one));
    }
    {
        LongCall call(device, 500);
        call.begin();
        const auto begin = std::chrono::steady_clock::now();
        std::thread([&] { shared[0]->deleter(shared[0]); }).join();
        EXPECT_LE(milliseconds_since(begin), 10 * timeout_scale());
        ASSERT_TRUE(call.running());
        EXPECT_EQ(call.finish(), SPLAT_OK);
    }
    device.destroy();
    EXPECT_EQ(static_cast<const float*>(shared[1]->dl_tensor.data)[3], 4);
    shared[1]->deleter(shared[1]);
}

}  // namespace
}  // namespace splat::test
