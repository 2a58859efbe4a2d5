#include "core/environment.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "support/decimal_comma.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat {
namespace {

constexpr const char* kName = "SPLAT_TEST_VARIABLE";

class Environment : public testing::Test {
  protected:
    void SetUp() override {
        cache_ = environment("XDG_CACHE_HOME");
        home_ = environment("HOME");
        local_ = environment("LOCALAPPDATA");
    }
    void TearDown() override {
        test::unset_variable(kName);
        restore("XDG_CACHE_HOME", cache_);
        restore("HOME", home_);
        restore("LOCALAPPDATA", local_);
    }
    static void restore(const char* name, const std::optional<std::string>& value) {
        value ? test::set_variable(name, *value) : test::unset_variable(name);
    }
    std::optional<std::string> cache_;
    std::optional<std::string> home_;
    std::optional<std::string> local_;
};

TEST_F(Environment, UnsetAndEmptyAreNothing) {
    test::unset_variable(kName);
    EXPECT_EQ(environment(kName), std::nullopt);
    test::set_variable(kName, "");
    EXPECT_EQ(environment(kName), std::nullopt);
    test::set_variable(kName, "value");
    EXPECT_EQ(environment(kName), "value");
}

TEST_F(Environment, PositiveNumbersOnly) {
    test::unset_variable(kName);
    EXPECT_EQ(environment_positive(kName, 3.5).value(), 3.5);
    for (const auto& [text, value] : {std::pair{"2", 2.0}, {"0.25", 0.25}, {"1e3", 1000.0}}) {
        test::set_variable(kName, text);
        EXPECT_EQ(environment_positive(kName, 1).value(), value);
    }
    for (const char* text : {"0", "-1", "abc", "1x", "inf", "nan", "1e999"}) {
        test::set_variable(kName, text);
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
    test::set_variable(kName, "0.25");
    EXPECT_EQ(environment_positive(kName, 1).value(), 0.25);
}

#if defined(_WIN32)
TEST_F(Environment, CacheFolderFollowsLocalApplicationData) {
    test::set_variable("LOCALAPPDATA", R"(C:\l)");
    EXPECT_EQ(user_cache_folder(), R"(C:\l/libsplat)");
    test::set_variable("LOCALAPPDATA", R"(relative\l)");
    EXPECT_EQ(user_cache_folder(), std::nullopt);
    test::unset_variable("LOCALAPPDATA");
    EXPECT_EQ(user_cache_folder(), std::nullopt);
}
#else
TEST_F(Environment, CacheFolderFollowsXdgThenHome) {
    test::set_variable("XDG_CACHE_HOME", "/x");
    test::set_variable("HOME", "/h");
    EXPECT_EQ(user_cache_folder(), "/x/libsplat");
    test::set_variable("XDG_CACHE_HOME", "relative/x");
    EXPECT_EQ(user_cache_folder(), "/h/.cache/libsplat");
    test::unset_variable("XDG_CACHE_HOME");
    EXPECT_EQ(user_cache_folder(), "/h/.cache/libsplat");
    test::unset_variable("HOME");
    EXPECT_EQ(user_cache_folder(), std::nullopt);
}
#endif

}  // namespace
}  // namespace splat
