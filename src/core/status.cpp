#include "core/status.h"

#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include "core/c_locale.h"
#include "core/log.h"

namespace splat {
namespace {

struct CodeRow {
    Code code;
    const char* name;
    const char* sentence;
};

constexpr CodeRow kCodes[] = {
    {Code::kOk, "SPLAT_OK", "The call succeeded."},
    {Code::kIncomplete, "SPLAT_INCOMPLETE",
     "The buffer was too small and holds a part; call again with the size reported as needed."},
    {Code::kInvalidArgument, "SPLAT_ERROR_INVALID_ARGUMENT",
     "An argument is outside its documented range; the message names it and both values."},
    {Code::kInvalidHandle, "SPLAT_ERROR_INVALID_HANDLE",
     "A handle is NULL, was destroyed, or is of another kind; pass a live one."},
    {Code::kInvalidState, "SPLAT_ERROR_INVALID_STATE",
     "The call does not fit the object's present state; the message says which call must come "
     "first."},
    {Code::kShape, "SPLAT_ERROR_SHAPE_MISMATCH",
     "Tensor shapes do not fit together; the message names the tensor, its shape and the one "
     "expected."},
    {Code::kUnsupported, "SPLAT_ERROR_UNSUPPORTED",
     "The request exceeds a limit or needs a feature that this device or build lacks."},
    {Code::kNoDevice, "SPLAT_ERROR_NO_DEVICE",
     "No Vulkan loader, driver or suitable device was found; run `vkrun doctor`."},
    {Code::kOutOfHostMemory, "SPLAT_ERROR_OUT_OF_HOST_MEMORY",
     "Host memory ran out, or the system starts no more threads; free some and repeat the call."},
    {Code::kOutOfDeviceMemory, "SPLAT_ERROR_OUT_OF_DEVICE_MEMORY",
     "Device memory or its budget ran out; free tensors, or raise max_device_bytes."},
    {Code::kTimeout, "SPLAT_ERROR_TIMEOUT",
     "The device did not finish in time; wait and repeat, or raise timeout_ns or "
     "SPLAT_TIMEOUT_SCALE."},
    {Code::kDeviceLost, "SPLAT_ERROR_DEVICE_LOST",
     "The device was lost; destroy it with all its objects and create it again."},
    {Code::kInternal, "SPLAT_ERROR_INTERNAL",
     "A defect in the library or the driver; please report the message."},
    {Code::kNotFound, "SPLAT_ERROR_NOT_FOUND",
     "A file, a folder or an entry of that name does not exist; the message names it."},
    {Code::kIo, "SPLAT_ERROR_IO",
     "The system refused to read or write a file; the message gives its path and the reason."},
    {Code::kFormat, "SPLAT_ERROR_FORMAT",
     "Bytes are damaged, truncated or of another format; the message says where."},
    {Code::kCancelled, "SPLAT_CANCELLED",
     "The call was cancelled; its results are undefined, and the object can be used again."},
};

const CodeRow* find(Code code) {
    for (const CodeRow& row : kCodes)
        if (row.code == code) return &row;
    return nullptr;
}

std::string vformat(const char* pattern, std::va_list args) {
    const CLocale point;
    std::va_list copy;
    va_copy(copy, args);
    const int length = std::vsnprintf(nullptr, 0, pattern, copy);
    va_end(copy);
    if (length < 0) return pattern;
    std::string text(static_cast<std::size_t>(length) + 1, '\0');
    std::vsnprintf(text.data(), text.size(), pattern, args);
    text.pop_back();
    return text;
}

}  // namespace

const char* code_name(Code code) {
    const CodeRow* row = find(code);
    return row != nullptr ? row->name : "SPLAT_UNKNOWN_RESULT";
}

const char* code_sentence(Code code) {
    const CodeRow* row = find(code);
    return row != nullptr ? row->sentence
                          : "This number is not a result code of this library version.";
}

// The formatted arguments after `pattern` of a variadic function.
#define SPLAT_VFORMAT(text)                    \
    std::va_list args;                         \
    va_start(args, pattern);                   \
    std::string text = vformat(pattern, args); \
    va_end(args)

std::string format(const char* pattern, ...) {
    SPLAT_VFORMAT(text);
    return text;
}

Status error(Code code, const char* pattern, ...) {
    SPLAT_VFORMAT(text);
    return {code, std::move(text)};
}

#define SPLAT_NAMED_ERROR(name, code)         \
    Status name(const char* pattern, ...) {   \
        SPLAT_VFORMAT(text);                  \
        return {Code::code, std::move(text)}; \
    }
SPLAT_NAMED_ERROR(invalid, kInvalidArgument)
SPLAT_NAMED_ERROR(damaged, kFormat)
SPLAT_NAMED_ERROR(unsupported, kUnsupported)
SPLAT_NAMED_ERROR(not_found, kNotFound)
SPLAT_NAMED_ERROR(bad_state, kInvalidState)

void assertion_failed(const char* condition, const char* file, int line) {
    log(LogLevel::kError, format("assertion failed: %s (%s:%d)", condition, file, line));
    std::abort();
}

}  // namespace splat
