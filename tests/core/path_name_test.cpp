#include "core/path_name.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "support/expect_status.h"
#include "support/hostile_names.h"

namespace splat {
namespace {

std::string text_of(const std::string& name) {
    return PathName(name).text();
}

TEST(PathName, UsualNamesStay) {
    for (const char* name :
         {"000001_car", "106_12648_23157", "sedan 35, red", "日本語", "a.b-c_d~e'f"})
        EXPECT_EQ(text_of(name), name);
}

TEST(PathName, EncodesWhatLeadsElsewhere) {
    EXPECT_EQ(text_of("../../x"), "%2E.%2F..%2Fx");
    EXPECT_EQ(text_of("C:\\x"), "C%3A%5Cx");
    EXPECT_EQ(text_of("100%"), "100%25");
    EXPECT_EQ(text_of("a\nb\x7f"), "a%0Ab%7F");
    EXPECT_EQ(text_of(".a. "), "%2Ea.%20");
    EXPECT_EQ(text_of("a\xff\xc3\xbc"), "a%FF\xc3\xbc");
    EXPECT_EQ(text_of(std::string("a\0b", 3)), "a%00b");
    EXPECT_EQ(text_of(""), "%");
}

TEST(PathName, DifferentNamesAreDifferentPartsOfAPath) {
    std::set<std::string> seen;
    for (const std::string& name : test::hostile_names()) {
        const std::string text = text_of(name);
        EXPECT_TRUE(seen.insert(text).second) << name;
        EXPECT_LE(text.size(), PathName::kLongest);
        const std::filesystem::path path = std::filesystem::path("out") / PathName(name);
        EXPECT_EQ(path.parent_path(), "out") << name;
        EXPECT_EQ(path.lexically_normal(), path) << name;
        EXPECT_TRUE(std::none_of(text.begin(), text.end(), [](char c) {
            return static_cast<unsigned char>(c) < 0x20 || c == '\\' || c == ':';
        })) << text;
    }
    EXPECT_EQ(seen.size(), 200U);
}

TEST(PathName, PathsOfDataLieBelow) {
    for (const char* path : {"a", "a/b.png", "./a", "a..b/c"}) EXPECT_OK(check_below(path));
    for (const char* path : {"", "..", "../a", "a/../../b", "/a"})
        EXPECT_ERROR(check_below(path), Code::kFormat, "expected one below the folder of the data");
}

}  // namespace
}  // namespace splat
