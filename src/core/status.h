#pragma once

#include <cassert>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

namespace splat {

/// Outcome of an operation. The numbers are those of splat_result in include/splat.h (checked in
/// src/api).
enum class Code : std::int32_t {
    kOk = 0,
    kIncomplete = 1,
    kInvalidArgument = -1,
    kInvalidHandle = -2,
    kInvalidState = -3,
    kShape = -4,
    kUnsupported = -5,
    kNoDevice = -6,
    kOutOfHostMemory = -7,
    kOutOfDeviceMemory = -8,
    kTimeout = -9,
    kDeviceLost = -10,
    kInternal = -11,
    kNotFound = -12,
    kIo = -13,
    kFormat = -14,
    kCancelled = -15,
};

/// The constant's name and its sentence; the only table of both is in status.cpp.
const char* code_name(Code code);
const char* code_sentence(Code code);

/// A code and, for an error, the sentence that names the argument, what was expected, what was got,
/// and what to do.
class [[nodiscard]] Status {
  public:
    Status() = default;
    Status(Code code, std::string message) : code_(code), message_(std::move(message)) {}

    [[nodiscard]] bool ok() const { return code_ == Code::kOk; }
    [[nodiscard]] Code code() const { return code_; }
    [[nodiscard]] const std::string& message() const { return message_; }

  private:
    Code code_ = Code::kOk;
    std::string message_;
};

/// A value, or the Status that says why it is missing.
template <class T>
class [[nodiscard]] Result {
  public:
    Result(T value) : value_(std::move(value)) {}
    Result(Status status) : status_(std::move(status)) { assert(!status_.ok()); }

    [[nodiscard]] bool ok() const { return value_.has_value(); }
    [[nodiscard]] const Status& status() const { return status_; }
    T& value() {
        assert(ok());
        return *value_;
    }
    const T& value() const {
        assert(ok());
        return *value_;
    }

  private:
    Status status_;
    std::optional<T> value_;
};

// mingw-w64 has two printf; C++ gets the one that knows %zu and %lld, as everywhere.
#if defined(__MINGW32__)
#define SPLAT_PRINTF gnu_printf
#else
#define SPLAT_PRINTF printf
#endif

/// printf into a std::string.
[[gnu::format(SPLAT_PRINTF, 1, 2)]] std::string format(const char* pattern, ...);
/// A number for %llu.
constexpr unsigned long long llu(std::uint64_t number) {
    return number;
}
/// A number for %lld.
constexpr long long lld(std::int64_t number) {
    return number;
}

/// An error with a formatted sentence.
[[gnu::format(SPLAT_PRINTF, 2, 3)]] Status error(Code code, const char* pattern, ...);

/// The same of the most frequent codes: kInvalidArgument, kFormat, kUnsupported, kNotFound and kInvalidState.
[[gnu::format(SPLAT_PRINTF, 1, 2)]] Status invalid(const char* pattern, ...);
[[gnu::format(SPLAT_PRINTF, 1, 2)]] Status damaged(const char* pattern, ...);
[[gnu::format(SPLAT_PRINTF, 1, 2)]] Status unsupported(const char* pattern, ...);
[[gnu::format(SPLAT_PRINTF, 1, 2)]] Status not_found(const char* pattern, ...);
[[gnu::format(SPLAT_PRINTF, 1, 2)]] Status bad_state(const char* pattern, ...);

/// Called by SPLAT_ASSERT: logs and aborts. A failed assertion is a defect of the library, never
/// bad input.
[[noreturn]] void assertion_failed(const char* condition, const char* file, int line);

}  // namespace splat

#define SPLAT_CONCAT_(a, b) a##b
#define SPLAT_CONCAT(a, b) SPLAT_CONCAT_(a, b)

/// Return the Status of `expr` from this function unless it is ok.
#define SPLAT_TRY(expr)                                                               \
    do {                                                                              \
        if (::splat::Status try_status = (expr); !try_status.ok()) return try_status; \
    } while (false)

/// `target = value of expr`, or return its Status from this function.
#define SPLAT_ASSIGN(target, expr) SPLAT_ASSIGN_(SPLAT_CONCAT(result_, __LINE__), target, expr)
#define SPLAT_ASSIGN_(name, target, expr) \
    auto name = (expr);                   \
    if (!name.ok()) return name.status(); \
    target = std::move(name.value())

/// SPLAT_ASSIGN for a target that is there, as one statement.
#define SPLAT_SET(target, expr)                  \
    do {                                         \
        SPLAT_ASSIGN_(set_result, target, expr); \
    } while (false)

#ifdef NDEBUG
#define SPLAT_ASSERT(condition) static_cast<void>(0)
#else
#define SPLAT_ASSERT(condition) \
    ((condition) ? static_cast<void>(0) : ::splat::assertion_failed(#condition, __FILE__, __LINE__))
#endif
