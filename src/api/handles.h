#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "nn/op_instance.h"
#include "splat.h"
#include "vk/context.h"

namespace splat::api {

/// What stands behind splat_device.
struct DeviceObject {
    std::shared_ptr<vk::Context> context;
};

/// What stands behind splat_tensor: row-major elements on the device.
struct TensorObject {
    std::shared_ptr<vk::Context> context;  ///< keeps the device open; destroyed after `buffer`
    std::string name;
    splat_dtype dtype = SPLAT_DTYPE_F32;
    vk::Buffer buffer;
    vk::BufferView view;
    splat_access mapped = 0;             ///< 0 while not mapped
    std::vector<std::byte> mapped_copy;  ///< where device memory is not host-visible

    ~TensorObject();
    [[nodiscard]] std::uint64_t bytes() const { return view.shape.elements() * 4; }
};

/// What stands behind splat_op.
struct OpObject {
    std::shared_ptr<vk::Context> context;
    std::vector<std::shared_ptr<TensorObject>> tensors;
    std::unique_ptr<nn::OpInstance> op;

    ~OpObject();
};

/// Live handles. A handle is a number that is never given twice, so a stale or foreign one is
/// recognised, not followed.
///
/// Errors: kInvalidHandle, naming `argument`; kOutOfHostMemory by exception.
template <class Object, class Handle>
struct Handles {
    static Handle add(std::shared_ptr<Object> object);
    static Result<std::shared_ptr<Object>> find(Handle handle, const char* argument);
    /// Also takes NULL, which gives an empty pointer.
    static Result<std::shared_ptr<Object>> remove(Handle handle, const char* argument);
};

using Devices = Handles<DeviceObject, splat_device>;
using Tensors = Handles<TensorObject, splat_tensor>;
using Ops = Handles<OpObject, splat_op>;

extern template struct Handles<DeviceObject, splat_device>;
extern template struct Handles<TensorObject, splat_tensor>;
extern template struct Handles<OpObject, splat_op>;

}  // namespace splat::api
