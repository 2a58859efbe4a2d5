#include <algorithm>
#include <cstring>
#include <string>
#include <utility>

#include "api/api_guard.h"
#include "core/log.h"

namespace splat::api {
namespace {

constexpr const char* kOutOfMemory = "host memory ran out; free some and repeat the call";

/// The last error of a thread. If there is no memory for its text, kOutOfMemory stands in.
struct LastError {
    std::string text;
    bool out_of_memory = false;
};

/// Larger than any struct of any version; a larger struct_size is a number that was never set.
constexpr std::size_t kMostStructBytes = 1 << 16;

LastError& last_error() {
    thread_local LastError instance;
    return instance;
}

const char* last_text() {
    const LastError& last = last_error();
    return last.out_of_memory ? kOutOfMemory : last.text.c_str();
}

}  // namespace

splat_result fail(const Status& status) noexcept {
    try {
        last_error().text = status.message();
        last_error().out_of_memory = false;
    } catch (...) {
        last_error().out_of_memory = true;
    }
    log(LogLevel::kDebug, last_text());
    return static_cast<splat_result>(status.code());
}

splat_result fail_out_of_memory() noexcept {
    last_error().out_of_memory = true;
    return SPLAT_ERROR_OUT_OF_HOST_MEMORY;
}

EntryPoint::EntryPoint() noexcept {
    hold_log();
}

EntryPoint::~EntryPoint() {
    mode_.end();
    if (!release_log()) return;
    LastError kept = std::exchange(last_error(), {});  // a copy would need memory
    deliver_log();
    last_error() = std::move(kept);
}

Status check_struct_size(std::size_t given, const char* type, std::size_t first_version_size,
                         std::size_t known_size) {
    if (given >= first_version_size && given <= kMostStructBytes) return {};
    return invalid("%s.struct_size is %zu, expected sizeof(%s) = %zu", type, given, type,
                   known_size);
}

Status check_reserved(std::uint32_t reserved, const char* type) {
    if (reserved == 0) return {};
    return invalid("%s.reserved is %u, expected 0", type, reserved);
}

Status check_flags(std::uint32_t flags, std::uint32_t known, const char* argument) {
    if ((flags & ~known) == 0) return {};
    return invalid("%s has unknown bits %#x", argument, flags & ~known);
}

Status check_tail(const void* given, std::size_t size, const char* type, std::size_t known_size) {
    const auto* const bytes = static_cast<const unsigned char*>(given);
    for (std::size_t i = known_size; i < size; ++i)
        if (bytes[i] != 0)
            return unsupported(
                "%s.struct_size is %zu and byte %zu is not zero, but this version knows %zu "
                "bytes: use a later library, or leave the new members zero",
                type, size, i, known_size);
    return {};
}

Status require(const void* pointer, const char* argument) {
    if (pointer != nullptr) return {};
    return invalid("%s is NULL", argument);
}

splat_result give_text(std::string_view text, char* buffer, std::size_t capacity,
                       std::size_t* needed) {
    if (needed != nullptr) *needed = text.size() + 1;
    if (buffer == nullptr || capacity == 0) return SPLAT_INCOMPLETE;
    const std::size_t copied = std::min(text.size(), capacity - 1);
    std::memcpy(buffer, text.data(), copied);
    buffer[copied] = '\0';
    return copied == text.size() ? SPLAT_OK : SPLAT_INCOMPLETE;
}

splat_result give_bytes(std::span<const std::byte> file, void* buffer, std::size_t capacity,
                        std::size_t* needed) {
    return give_bytes(std::span(&file, 1), buffer, capacity, needed);
}

splat_result give_bytes(std::span<const std::span<const std::byte>> pieces, void* buffer,
                        std::size_t capacity, std::size_t* needed) {
    std::size_t size = 0;
    for (const auto piece : pieces) size += piece.size();
    if (needed != nullptr) *needed = size;
    if (buffer == nullptr || capacity < size) return SPLAT_INCOMPLETE;
    auto* at = static_cast<std::byte*>(buffer);
    for (const auto piece : pieces) at = std::ranges::copy(piece, at).out;
    return SPLAT_OK;
}

}  // namespace splat::api

using splat::Code;
namespace api = splat::api;

static_assert(static_cast<splat_result>(Code::kIncomplete) == SPLAT_INCOMPLETE);
static_assert(static_cast<splat_result>(Code::kInvalidArgument) == SPLAT_ERROR_INVALID_ARGUMENT);
static_assert(static_cast<splat_result>(Code::kInvalidHandle) == SPLAT_ERROR_INVALID_HANDLE);
static_assert(static_cast<splat_result>(Code::kInvalidState) == SPLAT_ERROR_INVALID_STATE);
static_assert(static_cast<splat_result>(Code::kShape) == SPLAT_ERROR_SHAPE_MISMATCH);
static_assert(static_cast<splat_result>(Code::kUnsupported) == SPLAT_ERROR_UNSUPPORTED);
static_assert(static_cast<splat_result>(Code::kNoDevice) == SPLAT_ERROR_NO_DEVICE);
static_assert(static_cast<splat_result>(Code::kOutOfHostMemory) == SPLAT_ERROR_OUT_OF_HOST_MEMORY);
static_assert(static_cast<splat_result>(Code::kOutOfDeviceMemory) ==
              SPLAT_ERROR_OUT_OF_DEVICE_MEMORY);
static_assert(static_cast<splat_result>(Code::kTimeout) == SPLAT_ERROR_TIMEOUT);
static_assert(static_cast<splat_result>(Code::kDeviceLost) == SPLAT_ERROR_DEVICE_LOST);
static_assert(static_cast<splat_result>(Code::kInternal) == SPLAT_ERROR_INTERNAL);
static_assert(static_cast<splat_result>(Code::kNotFound) == SPLAT_ERROR_NOT_FOUND);
static_assert(static_cast<splat_result>(Code::kIo) == SPLAT_ERROR_IO);
static_assert(static_cast<splat_result>(Code::kFormat) == SPLAT_ERROR_FORMAT);
static_assert(static_cast<splat_result>(Code::kCancelled) == SPLAT_CANCELLED);

const char* splat_result_name(splat_result code) {
    return splat::code_name(static_cast<Code>(code));
}

const char* splat_result_sentence(splat_result code) {
    return splat::code_sentence(static_cast<Code>(code));
}

const char* splat_last_error_message(void) {
    return api::last_text();
}

splat_result splat_last_error_copy(char* buffer, size_t capacity, size_t* needed) {
    return api::give_text(api::last_text(), buffer, capacity, needed);
}

splat_result splat_log_set_callback(splat_log_callback callback, void* user,
                                    splat_log_level min_level) {
    return api::guarded([&]() -> splat::Status {
        if (min_level < 0 || min_level > SPLAT_LOG_ERROR)
            return splat::invalid("min_level is %d, expected 0 to %d", min_level, SPLAT_LOG_ERROR);
        const int level = min_level == 0 ? SPLAT_LOG_WARNING : min_level;
        splat::set_log_sink(callback, user, static_cast<splat::LogLevel>(level));
        return {};
    });
}
