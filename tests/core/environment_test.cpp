#include "core/environment.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/decimal_comma.h"
#include "support/expect_status.h"

namespace splat {
namespace {

constexpr const char* kName = "SPLAT_TEST_VARIABLE";

class Environment : public testing::Test {
  protected:
    void SetUp() override {
        cache_ = environment("XDG_CACHE_HOME");
        home_ = environment("HOME");
    }
    void TearDown() override {
        unsetenv(kName);
        restore("XDG_CACHE_HOME", cache_);
        restore("HOME", home_);
    }
    static void restore(const char* name, const std::optional<std::string>& value) {
        value ? setenv(name, value->c_str(), 1) : unsetenv(name);
    }
    std::optional<std::string> cache_;
    std::optional<std::string> home_;
};

TEST_F(Environment, UnsetAndEmptyAreNothing) {
    unsetenv(kName);
    EXPECT_EQ(environment(kName), std::nullopt);
    setenv(kName, "", 1);
    EXPECT_EQ(environment(kName), std::nullopt);
    setenv(kName, "value", 1);
    EXPECT_EQ(environment(kName), "value");
}

TEST_F(Environment, PositiveNumbersOnly) {
    unsetenv(kName);
    EXPECT_EQ(environment_positive(kName, 3.5).value(), 3.5);
    for (const auto& [text, value] : {std::pair{"2", 2.0}, {"0.25", 0.25}, {"1e3", 1000.0}}) {
        setenv(kName, text, 1);
        EXPECT_EQ(environment_positive(kName, 1).value(), value);
    }
    for (const char* text : {"0", "-1", "abc", "1x", "inf", "nan", "1e999"}) {
        setenv(kName, text, 1);
        const auto result = environment_positive(kName, 1);
        ASSERT_FALSE(result.ok()) << text;
        EXPECT_EQ(result.status().code(), Code::kInvalidArgument);
        EXPECT_HAS(result.status().message(), kName);
        EXPECT_HAS(result.status().message(), text);
    }
}

TEST_F(Environment, NumbersHaveDecimalPointsInAnyLocale) {
    const test::DecimalComma comma;
    if (!comma) GTEST_SKIP() << "no locale with decimal commas: install locales";
    setenv(kName, "0.25", 1);
    EXPECT_EQ(environment_positive(kName, 1).value(), 0.25);
}

TEST_F(Environment, CacheFolderFollowsXdgThenHome) {
    setenv("XDG_CACHE_HOME", "/x", 1);
    setenv("HOME", "/h", 1);
    EXPECT_EQ(user_cache_folder(), "/x/libsplat");
    setenv("XDG_CACHE_HOME", "relative/x", 1);
    EXPECT_EQ(user_cache_folder(), "/h/.cache/libsplat");
    unsetenv("XDG_CACHE_HOME");
    EXPECT_EQ(user_cache_folder(), "/h/.cache/libsplat");
    unsetenv("HOME");
    EXPECT_EQ(user_cache_folder(), std::nullopt);
}

}  // namespace
}  // namespace splat
