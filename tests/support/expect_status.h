#pragma once

#include <gtest/gtest.h>

#include <string_view>

#include "core/status.h"

namespace splat::test {

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

}  // namespace splat::test

#define EXPECT_OK(status) EXPECT_TRUE(::splat::test::is_ok(status))
#define ASSERT_OK(status) ASSERT_TRUE(::splat::test::is_ok(status))
#define EXPECT_ERROR(status, code, part) EXPECT_TRUE(::splat::test::is_error(status, code, part))
