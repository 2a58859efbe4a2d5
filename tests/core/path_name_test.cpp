#include "core/path_name.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/os/path.h"
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

TEST(PathName, EncodesDevicesOfWindows) {
    EXPECT_EQ(text_of("aux"), "%61ux");
    EXPECT_EQ(text_of("NUL"), "%4EUL");
    EXPECT_EQ(text_of("con.png"), "%63on.png");
    EXPECT_EQ(text_of("Com7 .tar.gz"), "%43om7 .tar.gz");
    EXPECT_EQ(text_of("lpt\xC2\xB2"), "%6Cpt\xC2\xB2");
    for (const char* name : {"auxiliary", "com", "com0", "com10", "nul_1", "a.con", "lpt.1"})
        EXPECT_EQ(text_of(name), name);
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
        EXPECT_FALSE(os::is_reserved_name(text)) << name;
        EXPECT_TRUE(std::none_of(text.begin(), text.end(), [](char c) {
            return static_cast<unsigned char>(c) < 0x20 || c == '\\' || c == ':';
        })) << text;
    }
    EXPECT_EQ(seen.size(), 200U);
}

TEST(PathName, PathsOfDataLieBelow) {
    for (const char* path : {"a", "a/b.png", "./a", "a..b/c", "a/", "aux/b", "a/12:30.png"})
        EXPECT_OK(check_below(path));
    for (const std::string path : {"", "..", "../a", "a/../../b", "/a", "a/.."})
        EXPECT_ERROR(check_below(path), Code::kFormat, "expected one below the folder of the data");
}

TEST(PathName, PathsOfDataAreThoseOfEverySystem) {
    for (const char* path : {"../images/a.png", "/data/a.png", "aux.png", "a b/ü.png", ""})
        EXPECT_OK(check_portable(path));
    for (const char* path :
         {"a\\b.png", "..\\..\\x", "C:x", "c:/x", "C:\\x", "a/C:x", "\\\\host\\x", "//host/x"}) {
        EXPECT_ERROR(check_portable(path), Code::kFormat, "expected one with '/' between folders");
        EXPECT_ERROR(check_below(path), Code::kFormat, "which every system reads alike");
    }
    EXPECT_ERROR(check_portable({"a\0b", 3}), Code::kFormat, "the path 'a?b'");
}

TEST(PathName, NamesInFolders) {
    for (const char* name : {"a", ".a", "a..", "NUL", "con.png", "12:30", "a b "})
        EXPECT_TRUE(is_name_in_folder(name)) << name;
    for (const char* name : {"", ".", "..", "a/b", "/", "a\\b", "\\", "C:", "c:x"})
        EXPECT_FALSE(is_name_in_folder(name)) << name;
    EXPECT_FALSE(is_name_in_folder({"a\0", 2}));
}

}  // namespace
}  // namespace splat
