#include "core/status.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <set>
#include <string>

#include "support/decimal_comma.h"

namespace splat {
namespace {

constexpr Code kAllCodes[] = {
    Code::kOk,
    Code::kIncomplete,
    Code::kInvalidArgument,
    Code::kInvalidHandle,
    Code::kInvalidState,
    Code::kShape,
    Code::kUnsupported,
    Code::kNoDevice,
    Code::kOutOfHostMemory,
    Code::kOutOfDeviceMemory,
    Code::kTimeout,
    Code::kDeviceLost,
    Code::kInternal,
    Code::kNotFound,
    Code::kIo,
    Code::kFormat,
    Code::kCancelled,
};
constexpr int kLowest = -15;
constexpr int kHighest = 1;

TEST(Status, TableIsCompleteAndUnique) {
    EXPECT_EQ(std::size(kAllCodes), static_cast<std::size_t>(kHighest - kLowest + 1));
    std::set<std::string> names;
    std::set<std::string> sentences;
    for (int number = kLowest; number <= kHighest; ++number) {
        const auto code = static_cast<Code>(number);
        const std::string name = code_name(code);
        const std::string sentence = code_sentence(code);
        EXPECT_TRUE(names.insert(name).second) << name;
        EXPECT_TRUE(sentences.insert(sentence).second) << sentence;
        const bool failure = number < 0 && code != Code::kCancelled;
        EXPECT_TRUE(name.starts_with(failure ? "SPLAT_ERROR_" : "SPLAT_")) << name;
        EXPECT_NE(name, "SPLAT_UNKNOWN_RESULT") << number;
        EXPECT_TRUE(sentence.ends_with(".")) << sentence;
    }
}

TEST(Status, UnknownNumbersHaveAName) {
    for (const int number : {kLowest - 1, kHighest + 1, 12345, -12345}) {
        EXPECT_STREQ(code_name(static_cast<Code>(number)), "SPLAT_UNKNOWN_RESULT");
        EXPECT_NE(code_sentence(static_cast<Code>(number)), nullptr);
    }
}

TEST(Status, FormatsLongMessages) {
    const std::string longer(5000, 'x');
    const Status status = error(Code::kShape, "tensor %s is %d", longer.c_str(), 7);
    EXPECT_FALSE(status.ok());
    EXPECT_EQ(status.code(), Code::kShape);
    EXPECT_EQ(status.message(), "tensor " + longer + " is 7");
    EXPECT_EQ(format("%s", ""), "");
    EXPECT_TRUE(Status().ok());
}

TEST(Status, NumbersHaveDecimalPointsInAnyLocale) {
    const test::DecimalComma comma;
    if (!comma) GTEST_SKIP() << "no locale with decimal commas: install locales";
    EXPECT_EQ(format("%g %.2f", 1.5, 0.25), "1.5 0.25");
    EXPECT_EQ(error(Code::kShape, "%g", 1.5).message(), "1.5");
    char text[8];
    std::snprintf(text, sizeof text, "%g", 1.5);
    EXPECT_STREQ(text, "1,5") << "the host's locale is as it was";
}

Status fail_if(bool fail) {
    return fail ? error(Code::kTimeout, "failed") : Status{};
}

Result<int> half(int number) {
    if (number % 2 != 0) return error(Code::kInvalidArgument, "%d is odd", number);
    return number / 2;
}

Result<int> quarter(int number, int& steps) {
    SPLAT_TRY(fail_if(number < 0));
    ++steps;
    SPLAT_ASSIGN(const int first, half(number));
    ++steps;
    SPLAT_ASSIGN(const int second, half(first));
    ++steps;
    return second;
}

TEST(Result, TryAndAssignStopAtTheFirstError) {
    int steps = 0;
    EXPECT_EQ(quarter(12, steps).value(), 3);
    EXPECT_EQ(steps, 3);
    steps = 0;
    EXPECT_EQ(quarter(6, steps).status().message(), "3 is odd");
    EXPECT_EQ(steps, 2);
    steps = 0;
    EXPECT_EQ(quarter(-4, steps).status().code(), Code::kTimeout);
    EXPECT_EQ(steps, 0);
}

}  // namespace
}  // namespace splat
