#pragma once

#include <gtest/gtest.h>

#include <string_view>
#include <utility>

#include "core/status.h"

namespace splat {
namespace test {

inline testing::AssertionResult is_ok(const Status& status) {
    if (status.ok()) return testing::AssertionSuccess();
    return testing::AssertionFailure() << code_name(status.code()) << ": " << status.message();
}

/// The status has this code and a message that contains `part`.
inline testing::AssertionResult is_error(const Status& status, Code code, std::string_view part) {
    if (status.code() == code && status.message().find(part) != std::string::npos)
        return testing::AssertionSuccess();
    return testing::AssertionFailure()
           << code_name(status.code()) << ": '" << status.message() << "', expected "
           << code_name(code) << " with '" << part << "'";
}

/// A Result, or another object with a status().
template <class Made>
testing::AssertionResult is_ok(const Made& made) {
    return is_ok(made.status());
}

template <class Made>
testing::AssertionResult is_error(const Made& made, Code code, std::string_view part) {
    return is_error(made.status(), code, part);
}

inline testing::AssertionResult holds(std::string_view text, std::string_view part) {
    const bool found = text.find(part) != std::string_view::npos;
    return (found ? testing::AssertionSuccess() : testing::AssertionFailure())
           << "'" << text << (found ? "' holds '" : "' lacks '") << part << "'";
}

}  // namespace test

/// The value. Where there is none, the test fails at the caller's line and ends.
template <class T>
T need(Result<T> result, const char* file = __builtin_FILE(), int line = __builtin_LINE()) {
    if (result.ok()) return std::move(result.value());
    const auto reason = test::is_ok(result);
    ADD_FAILURE_AT(file, line) << reason.message();
    throw testing::AssertionException(testing::TestPartResult(
        testing::TestPartResult::kFatalFailure, file, line, reason.message()));
}

}  // namespace splat

#define EXPECT_OK(status) EXPECT_TRUE(::splat::test::is_ok(status))
#define ASSERT_OK(status) ASSERT_TRUE(::splat::test::is_ok(status))
#define EXPECT_ERROR(status, code, part) EXPECT_TRUE(::splat::test::is_error(status, code, part))
/// The text contains the part, and does not.
#define EXPECT_HAS(text, part) EXPECT_TRUE(::splat::test::holds(text, part))
#define EXPECT_LACKS(text, part) EXPECT_FALSE(::splat::test::holds(text, part))
