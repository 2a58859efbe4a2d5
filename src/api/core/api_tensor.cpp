#include <algorithm>
#include <cstring>

#include "api/api_guard.h"
#include "api/core/dlpack.h"
#include "api/core/strides.h"
#include "api/core/tensor_arguments.h"
#include "api/handles.h"
#include "ops/tensor_stats.h"

using namespace splat;

namespace {

using TensorPointer = std::shared_ptr<api::TensorObject>;

/// A tensor as described, in memory that `place(context, bytes, name)` returns. Locks the context meanwhile.
template <class Place>
Result<TensorPointer> describe(splat_device device, const splat_tensor_desc* desc,
                               std::uint32_t known_flags, Place&& place) {
    SPLAT_ASSIGN(const auto owner, api::find(device));
    SPLAT_TRY(api::check_desc(desc, known_flags));
    if (desc->dtype < 0 || desc->dtype > SPLAT_DTYPE_U32)
        return invalid("splat_tensor_desc.dtype is %d, expected 0 to %d", desc->dtype,
                       SPLAT_DTYPE_U32);
    if (desc->rank > SPLAT_MAX_RANK)
        return invalid("splat_tensor_desc.rank is %u, expected at most %d", desc->rank,
                       SPLAT_MAX_RANK);
    auto tensor = std::make_shared<api::TensorObject>(owner->context);
    tensor->name = desc->name != nullptr ? desc->name : "unnamed";
    tensor->dtype = desc->dtype == 0 ? SPLAT_DTYPE_F32 : desc->dtype;
    SPLAT_ASSIGN(const Shape shape,
                 Shape::create({desc->dims, desc->rank}, "tensor '" + tensor->name + "'"));

    vk::Context& context = *tensor->context;
    const std::lock_guard lock(context.mutex);
    const std::uint64_t bytes = vk::quad_bytes(shape.elements());
    const std::uint64_t most = context.device().info().limits.max_storage_buffer_bytes;
    if (bytes > most)
        return unsupported(
            "tensor '%s' of shape %s has %llu bytes, but the device binds at most %llu; "
            "split it along an outer "
            "dimension",
            tensor->name.c_str(), shape.text().c_str(), llu(bytes), llu(most));
    SPLAT_ASSIGN(tensor->buffer, place(context, bytes, "tensor '" + tensor->name + "'"));
    tensor->view = tensor->buffer.view(shape);
    return tensor;
}

Result<TensorPointer> create(splat_device device, const splat_tensor_desc* desc) {
    const auto zeros = [desc](vk::Context& context, std::uint64_t bytes,
                              const std::string& name) -> Result<vk::Buffer> {
        const bool external = (desc->flags & SPLAT_TENSOR_EXPORTABLE) != 0;
        SPLAT_ASSIGN(
            vk::Buffer buffer,
            context.memory().allocate(
                bytes, external ? vk::MemoryKind::kExternal : vk::MemoryKind::kDevice, name));
        SPLAT_TRY(context.fill(buffer.range(), 0));
        return buffer;
    };
    return describe(device, desc, SPLAT_TENSOR_EXPORTABLE, zeros);
}

Result<TensorPointer> open_external(splat_device device, const splat_tensor_desc* desc,
                                    const splat_external_memory* memory) {
    splat_external_memory given{};
    SPLAT_TRY(api::take_input(memory, "memory", given));
    vk::ExternalMemory from;
    SPLAT_COPY(from, given, handle, memory_bytes, offset, memory_type);
    std::ranges::copy(given.device_uuid, from.device_uuid.begin());
    std::ranges::copy(given.driver_uuid, from.driver_uuid.begin());
    return describe(device, desc, 0,
                    [&](vk::Context& context, std::uint64_t bytes, const std::string& name) {
                        return context.memory().import_memory(from, bytes, name);
                    });
}

Result<splat_external_memory> export_memory(api::TensorObject& tensor) {
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    SPLAT_TRY(api::check_unmapped(tensor));
    SPLAT_ASSIGN(const vk::ExternalMemory memory, context.memory().export_memory(tensor.view));
    splat_external_memory filled{};
    SPLAT_COPY(filled, memory, handle, memory_bytes, offset, memory_type);
    std::ranges::copy(memory.device_uuid, filled.device_uuid);
    std::ranges::copy(memory.driver_uuid, filled.driver_uuid);
    return filled;
}

Status write(api::TensorObject& tensor, const void* data, std::size_t bytes,
             const std::int64_t* strides) {
    SPLAT_TRY(api::require(data, "data"));
    SPLAT_ASSIGN(const api::HostLayout layout,
                 api::host_layout(tensor.view.shape, strides, bytes, false));
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    SPLAT_TRY(api::check_unmapped(tensor));
    tensor.written();
    if (layout.contiguous) return context.write(tensor.view, data, tensor.bytes());
    std::vector<std::byte> contiguous(tensor.bytes());
    api::gather(tensor.view.shape, layout, static_cast<const std::byte*>(data), contiguous.data());
    return context.write(tensor.view, contiguous.data(), contiguous.size());
}

Status read(api::TensorObject& tensor, void* data, std::size_t bytes, const std::int64_t* strides) {
    SPLAT_TRY(api::require(data, "data"));
    SPLAT_ASSIGN(const api::HostLayout layout,
                 api::host_layout(tensor.view.shape, strides, bytes, true));
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    SPLAT_TRY(api::check_unmapped(tensor));
    // Host-visible memory needs one copy, which cannot fail half-way; a staged read fills another
    // buffer first.
    if (layout.contiguous && vk::Memory::host(tensor.view) != nullptr)
        return context.read(tensor.view, data, tensor.bytes());
    std::vector<std::byte> contiguous(tensor.bytes());
    SPLAT_TRY(context.read(tensor.view, contiguous.data(), contiguous.size()));
    if (layout.contiguous)
        std::memcpy(data, contiguous.data(), contiguous.size());
    else
        api::scatter(tensor.view.shape, layout, contiguous.data(), static_cast<std::byte*>(data));
    return {};
}

Status map(api::TensorObject& tensor, splat_access access, void** pointer, std::size_t* bytes) {
    SPLAT_TRY(api::require(pointer, "pointer"));
    if (access < SPLAT_ACCESS_READ || access > SPLAT_ACCESS_READ_WRITE)
        return invalid("access is %d, expected %d to %d", access, SPLAT_ACCESS_READ,
                       SPLAT_ACCESS_READ_WRITE);
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    SPLAT_TRY(api::check_unmapped(tensor));
    SPLAT_TRY(context.device().alive());
    void* host = vk::Memory::host(tensor.view);
    if (host != nullptr) {
        SPLAT_TRY(context.settle());
        SPLAT_TRY(context.flush());
        SPLAT_TRY(context.memory().invalidate(tensor.view));
    } else {
        std::vector<std::byte> copy(tensor.bytes());
        if (access != SPLAT_ACCESS_WRITE)
            SPLAT_TRY(context.read(tensor.view, copy.data(), copy.size()));
        tensor.mapped_copy = std::move(copy);
        host = tensor.mapped_copy.data();
    }
    tensor.begin_mapping(access);
    *pointer = host;
    if (bytes != nullptr) *bytes = tensor.bytes();
    return {};
}

Status unmap(api::TensorObject& tensor) {
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    if (tensor.mapped == 0) return bad_state("tensor '%s' is not mapped", tensor.name.c_str());
    SPLAT_TRY(context.device().alive());
    if (tensor.mapped != SPLAT_ACCESS_READ) {
        if (vk::Memory::host(tensor.view) != nullptr)
            SPLAT_TRY(context.memory().flush(tensor.view));
        else
            SPLAT_TRY(
                context.write(tensor.view, tensor.mapped_copy.data(), tensor.mapped_copy.size()));
    }
    tensor.end_mapping();
    tensor.mapped_copy = {};
    return {};
}

Result<ops::TensorStats> measure(api::TensorObject& tensor) {
    vk::Context& context = *tensor.context;
    const std::lock_guard lock(context.mutex);
    SPLAT_TRY(api::check_unmapped(tensor));
    if (tensor.dtype != SPLAT_DTYPE_F32)
        return invalid("tensor '%s' has dtype %d, expected SPLAT_DTYPE_F32", tensor.name.c_str(),
                       tensor.dtype);
    const std::uint64_t elements = tensor.view.shape.elements();
    const std::uint64_t bytes = ops::tensor_stats_partial_bytes(elements);
    SPLAT_ASSIGN(const vk::Buffer partial,
                 context.memory().allocate(bytes, vk::MemoryKind::kDevice, "tensor statistics"));
    vk::Recorder recorder(context);
    SPLAT_TRY(ops::tensor_stats(recorder, elements, tensor.view, partial.range()));
    SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
    SPLAT_TRY(context.run(list));
    std::vector<std::uint32_t> words(bytes / 4);
    SPLAT_TRY(context.read(partial.range(), words.data(), bytes));
    return ops::tensor_stats_merge(words);
}

}  // namespace

splat_result splat_tensor_create(splat_device device, const splat_tensor_desc* desc,
                                 splat_tensor* tensor) {
    return api::create(tensor, [&] { return create(device, desc); });
}

splat_result splat_tensor_from_host(splat_device device, const splat_tensor_desc* desc,
                                    const void* data, size_t bytes, const int64_t* strides,
                                    splat_tensor* tensor) {
    return api::create(tensor, [&]() -> api::Tensors::Made {
        SPLAT_TRY(api::require(data, "data"));
        SPLAT_ASSIGN(TensorPointer object, create(device, desc));
        SPLAT_TRY(write(*object, data, bytes, strides));
        return object;
    });
}

splat_result splat_tensor_import(splat_device device, const splat_tensor_desc* desc,
                                 const splat_external_memory* memory, splat_tensor* tensor) {
    return api::create(tensor, [&] { return open_external(device, desc, memory); });
}

splat_result splat_tensor_export(splat_tensor tensor, splat_external_memory* memory) {
    return api::describe(tensor, memory, "memory", export_memory);
}

splat_result splat_tensor_write(splat_tensor tensor, const void* data, size_t bytes,
                                const int64_t* strides) {
    return api::with(
        tensor, [&](const auto& object) -> Status { return write(*object, data, bytes, strides); });
}

splat_result splat_tensor_read(splat_tensor tensor, void* data, size_t bytes,
                               const int64_t* strides) {
    return api::with(
        tensor, [&](const auto& object) -> Status { return read(*object, data, bytes, strides); });
}

splat_result splat_tensor_map(splat_tensor tensor, splat_access access, void** pointer,
                              size_t* bytes) {
    return api::with(
        tensor, [&](const auto& object) -> Status { return map(*object, access, pointer, bytes); });
}

splat_result splat_tensor_unmap(splat_tensor tensor) {
    return api::with(tensor, [&](const auto& object) -> Status { return unmap(*object); });
}

splat_result splat_tensor_host_pointer(splat_tensor tensor, void** pointer, size_t* bytes) {
    return api::with(tensor, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(pointer, "pointer"));
        SPLAT_TRY(api::check_unmapped(*object));
        SPLAT_ASSIGN(void* const host, api::host_pointer(*object));
        object->expose();
        *pointer = host;
        if (bytes != nullptr) *bytes = object->bytes();
        return {};
    });
}

splat_result splat_tensor_to_dlpack(splat_tensor tensor, DLManagedTensorVersioned** managed) {
    return api::with(tensor, [&](const auto& object) -> Status {
        SPLAT_TRY(api::require(managed, "managed"));
        SPLAT_TRY(api::check_unmapped(*object));
        SPLAT_ASSIGN(*managed, api::dlpack_of(object));
        object->expose();
        return {};
    });
}

splat_result splat_tensor_get_info(splat_tensor tensor, splat_tensor_info* info) {
    return api::describe(tensor, info, "info", [&](auto& object) {
        splat_tensor_info filled{};
        const Shape& shape = object.view.shape;
        filled.dtype = object.dtype;
        filled.rank = shape.rank();
        filled.mapped = object.mapped != 0 ? 1 : 0;
        for (std::uint32_t axis = 0; axis < shape.rank(); ++axis) filled.dims[axis] = shape[axis];
        filled.elements = shape.elements();
        filled.bytes = object.bytes();
        std::memcpy(filled.name, object.name.data(),
                    std::min(object.name.size(), sizeof filled.name - 1));
        return filled;
    });
}

splat_result splat_tensor_check(splat_tensor tensor, splat_tensor_stats* stats) {
    return api::describe(tensor, stats, "stats", [&](auto& object) -> Result<splat_tensor_stats> {
        SPLAT_ASSIGN(const ops::TensorStats measured, measure(object));
        splat_tensor_stats filled{};
        SPLAT_COPY(filled, measured, nan_count, inf_count, min, max, mean);
        return filled;
    });
}
