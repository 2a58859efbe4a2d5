// The rows of tensors and operators.
#include "api/misuse/misuse_table.h"

namespace splat::test {
namespace {

constexpr float kFour[4] = {1, 2, 3, 4};

}  // namespace

void MisuseTable::tensor_create_rows() {
    const splat_tensor_desc good = tensor_desc({4}, "mine");
    const auto from_host = [this](splat_device device, const splat_tensor_desc* desc,
                                  const void* data, std::size_t bytes,
                                  const std::int64_t* strides) {
        return splat_tensor_from_host(device, desc, data, bytes, strides, out<splat_tensor>());
    };
    const auto both = [&](const char* parameter, const char* what, splat_result expected,
                          const splat_tensor_desc* desc) {
        const bool null = desc == nullptr;
        const splat_tensor_desc copy = null ? good : *desc;
        add("splat_tensor_create", parameter, what, expected, [this, null, copy] {
            return splat_tensor_create(device_, null ? nullptr : &copy, out<splat_tensor>());
        });
        add("splat_tensor_from_host", parameter, what, expected, [this, from_host, null, copy] {
            return from_host(device_, null ? nullptr : &copy, kFour, sizeof kFour, nullptr);
        });
    };
    both("desc", "NULL", kArgument, nullptr);
    const auto invalid = [&](const char* what, void (*change)(splat_tensor_desc&)) {
        splat_tensor_desc desc = good;
        change(desc);
        both("desc", what, kArgument, &desc);
    };
    invalid("a rank too high", [](splat_tensor_desc& desc) { desc.rank = SPLAT_MAX_RANK + 1; });
    invalid("the highest rank", [](splat_tensor_desc& desc) { desc.rank = UINT32_MAX; });
    invalid("an unknown dtype", [](splat_tensor_desc& desc) { desc.dtype = 4; });
    invalid("a negative dtype", [](splat_tensor_desc& desc) { desc.dtype = -1; });
    invalid("no elements", [](splat_tensor_desc& desc) { desc.dims[0] = 0; });
    invalid("too many elements", [](splat_tensor_desc& desc) { desc.dims[0] = INT64_MAX; });
}

void MisuseTable::tensor_copy_rows() {
    const splat_tensor_desc good = tensor_desc({4}, "mine");
    using Copy = std::function<splat_result(bool null, std::size_t, const std::int64_t*)>;
    const std::pair<const char*, Copy> copies[] = {
        {"splat_tensor_write",
         [this](bool null, std::size_t bytes, const std::int64_t* strides) {
             return splat_tensor_write(tensor_, null ? nullptr : kFour, bytes, strides);
         }},
        {"splat_tensor_read",
         [this](bool null, std::size_t bytes, const std::int64_t* strides) {
             void* const data = values_out();
             return splat_tensor_read(tensor_, null ? nullptr : data, bytes, strides);
         }},
        {"splat_tensor_from_host",
         [this, good](bool null, std::size_t bytes, const std::int64_t* strides) {
             return splat_tensor_from_host(device_, &good, null ? nullptr : kFour, bytes, strides,
                                           out<splat_tensor>());
         }},
    };
    for (const auto& [name, function] : copies) {
        const Copy copy = function;
        add(name, "data", "NULL", kArgument, [copy] { return copy(true, 16, nullptr); });
        for (const std::size_t bytes : {std::size_t{0}, std::size_t{15}})
            add(name, "bytes", "too few", kArgument,
                [copy, bytes] { return copy(false, bytes, nullptr); });
        for (const std::int64_t stride : {std::int64_t{-1}, INT64_MIN, INT64_MAX, std::int64_t{2}})
            add(name, "strides", "outside the memory given", kArgument,
                [copy, stride] { return copy(false, 16, &stride); });
    }
}

void MisuseTable::tensor_rows() {
    for (const splat_access access : {INT32_MIN, -1, 0, 4, INT32_MAX})
        for (const char* parameter : {"access", "bytes"})
            add("splat_tensor_map", parameter, "with an unknown access", kArgument, [this, access] {
                return splat_tensor_map(tensor_, access, out<void*>(), out<std::size_t>());
            });
    add("splat_tensor_unmap", "tensor", "not mapped", SPLAT_ERROR_INVALID_STATE,
        [this] { return splat_tensor_unmap(tensor_); });
    add("splat_tensor_host_pointer", "bytes", "with a NULL pointer", kArgument,
        [this] { return splat_tensor_host_pointer(tensor_, nullptr, nullptr); });
}

void MisuseTable::op_rows() {
    add("splat_op_backward", "op", "before the first forward", SPLAT_ERROR_INVALID_STATE,
        [this] { return splat_op_backward(op_); });
}

void MisuseTable::op_desc_rows() {
    const auto create = [this](const splat_op_desc* desc) {
        return splat_op_create(device_, desc, out<splat_op>());
    };
    handles<splat_tensor>(
        "splat_op_create", "desc",
        [this, create](splat_tensor t) {
            OpRequest request = request_;
            request.inputs[0] = t;
            const splat_op_desc desc = request.desc();
            return create(&desc);
        },
        kHandle);
}

}  // namespace splat::test
