#include "core/shown.h"

#include <gtest/gtest.h>

namespace splat {
namespace {

TEST(Shown, CutsLongTextsBetweenLetters) {
    EXPECT_EQ(shown(""), "");
    EXPECT_EQ(shown("name"), "name");
    EXPECT_EQ(shown(std::string(200, 'x')), std::string(200, 'x'));
    EXPECT_EQ(shown(std::string(3'000'000, 'x')), std::string(200, 'x') + "...");
    EXPECT_EQ(shown("ab\u00e9d", 4), "ab\u00e9...");
    EXPECT_EQ(shown("ab\u00e9d", 3), "ab...");
    EXPECT_EQ(shown("a\U0001f600b", 4), "a...");
    EXPECT_EQ(shown(std::string(9, '\x80'), 5), std::string(2, '\x80') + "...") << "not UTF-8";
}

TEST(Shown, HasNoControlCharacters) {
    EXPECT_EQ(shown(std::string_view("a\0b\n\x1b[2J\x7f", 9)), "a?b??[2J?");
}

}  // namespace
}  // namespace splat
