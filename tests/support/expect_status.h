#pragma once

#include <gtest/gtest.h>

#include "core/status.h"

/// The Status or Result is ok; otherwise its code and message.
#define EXPECT_OK(expr)                                                               \
    do {                                                                              \
        const ::splat::Status expect_status = (expr);                                 \
        EXPECT_TRUE(expect_status.ok())                                               \
            << ::splat::code_name(expect_status.code()) << ": " << expect_status.message(); \
    } while (false)

#define ASSERT_OK(expr)                                                               \
    do {                                                                              \
        const ::splat::Status assert_status = (expr);                                 \
        ASSERT_TRUE(assert_status.ok())                                               \
            << ::splat::code_name(assert_status.code()) << ": " << assert_status.message(); \
    } while (false)

/// The Status has this code and a message that contains `part`.
#define EXPECT_ERROR(expr, expected_code, part)                                                  \
    do {                                                                                         \
        const ::splat::Status expect_status = (expr);                                            \
        EXPECT_STREQ(::splat::code_name(expect_status.code()), ::splat::code_name(expected_code)) \
            << expect_status.message();                                                          \
        EXPECT_NE(expect_status.message().find(part), std::string::npos)                         \
            << expect_status.message();                                                          \
    } while (false)
