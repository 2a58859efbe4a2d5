#include "api/core/dlpack.h"

#include <array>

// The structs of the DLPack specification, "C API (dlpack.h)", ABI version 1.x:
// https://dmlc.github.io/dlpack/latest/c_api.html
struct DLPackVersion {
    std::uint32_t major;
    std::uint32_t minor;
};

struct DLDevice {
    std::int32_t device_type;
    std::int32_t device_id;
};

struct DLDataType {
    std::uint8_t code;
    std::uint8_t bits;
    std::uint16_t lanes;
};

struct DLTensor {
    void* data;
    DLDevice device;
    std::int32_t ndim;
    DLDataType dtype;
    std::int64_t* shape;
    std::int64_t* strides;  ///< elements
    std::uint64_t byte_offset;
};

struct DLManagedTensorVersioned {
    DLPackVersion version;
    void* manager_ctx;
    void (*deleter)(DLManagedTensorVersioned* self);
    std::uint64_t flags;  ///< 0: neither read-only nor a copy
    DLTensor dl_tensor;
};

namespace splat::api {
namespace {

constexpr DLPackVersion kDlpackVersion = {1, 0};
constexpr std::int32_t kDlpackCpu = 1;

/// The struct with the arrays that it points to, and its reference.
struct SharedTensor {
    std::shared_ptr<TensorObject> tensor;
    std::array<std::int64_t, SPLAT_MAX_RANK> shape{};
    std::array<std::int64_t, SPLAT_MAX_RANK> strides{};
    DLManagedTensorVersioned managed{};
};

void delete_shared(DLManagedTensorVersioned* self) {
    if (self != nullptr) delete static_cast<SharedTensor*>(self->manager_ctx);
}

DLDataType dlpack_type(splat_dtype dtype) {
    constexpr std::uint8_t kInt = 0, kUInt = 1, kFloat = 2;
    const std::uint8_t code = dtype == SPLAT_DTYPE_F32   ? kFloat
                              : dtype == SPLAT_DTYPE_I32 ? kInt
                                                         : kUInt;
    return {code, 32, 1};
}

}  // namespace

Result<void*> host_pointer(const TensorObject& tensor) {
    void* const host = vk::Memory::host(tensor.view);
    if (host != nullptr && vk::Memory::coherent(tensor.view)) return host;
    return unsupported(
        "tensor '%s': the host has no lasting pointer into the memory of device %u (%s), "
        "which is not %s; use splat_tensor_map",
        tensor.name.c_str(), tensor.context->device().info().index,
        tensor.context->device().info().name.c_str(), host == nullptr ? "unified" : "coherent");
}

Result<DLManagedTensorVersioned*> dlpack_of(std::shared_ptr<TensorObject> tensor) {
    SPLAT_ASSIGN(void* const data, host_pointer(*tensor));
    auto shared = std::make_unique<SharedTensor>();
    const Shape& shape = tensor->view.shape;
    std::int64_t stride = 1;
    for (std::uint32_t axis = shape.rank(); axis-- > 0;) {
        shared->shape[axis] = shape[axis];
        shared->strides[axis] = stride;
        stride *= shape[axis];
    }
    DLManagedTensorVersioned& managed = shared->managed;
    managed.version = kDlpackVersion;
    managed.deleter = delete_shared;
    managed.dl_tensor.data = data;
    managed.dl_tensor.device = {kDlpackCpu, 0};
    managed.dl_tensor.ndim = static_cast<std::int32_t>(shape.rank());
    managed.dl_tensor.dtype = dlpack_type(tensor->dtype);
    managed.dl_tensor.shape = shared->shape.data();
    managed.dl_tensor.strides = shared->strides.data();
    shared->tensor = std::move(tensor);
    managed.manager_ctx = shared.release();
    return &managed;
}

}  // namespace splat::api
