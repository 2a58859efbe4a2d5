#pragma once

#include <set>
#include <string>
#include <vector>

namespace splat::test {

// clang-format off
inline constexpr const char* kHostileNames[] = {
    ".", "..", "...", "../x", "../../../../ESCAPED", "/ESCAPED", "/", "//", "a/b", "a/../b",
    "./a", "a/", "\\", "..\\x", "C:", "C:\\x", "C:/x", "\\\\host\\x", "~", "~/x", "-rf", "--out",
    "$HOME", "`x`", "a;b", "a|b", "a&b", "a>b", "*", "?", "a,b", ",", "\"", "\"a\"", "a\"b,c",
    "'", "a b", " a", "a ", " ", "a\tb", "a\nb", "a\r\nb", "\r", "\x01", "\x7f", "\x1b[31m", "%",
    "%2E", "%2E.", "%%", "a%", "a.", ".a", "a..", "NUL", "con.txt", "ü", "u\xcc\x88", "日本語",
    "\xF0\x9F\x9A\x97", "\xff", "\xc3", "a\xfe", "\xc0\xaf", "\xed\xa0\x80", "<b>", "&amp;",
    "{\"a\":1}", "[1]", "#", "null", "nan", "1e5", "0", "-1", "true", "a=b", "x.tmp", ".x.tmp",
    "store.json", "0000_a", "\xe2\x80\xae" "gpj.exe", "a\xc2\xa0" "b", "\xef\xbb\xbf" "a",
};
// clang-format on

/// 200 names as data may have them: separators, dots, drive letters, control characters, blanks, quotes, commas, other
/// scripts, bytes that are not UTF-8, and lengths to 300. All are different; none is empty or has a NUL.
inline std::vector<std::string> hostile_names() {
    std::set<std::string> names(std::begin(kHostileNames), std::end(kHostileNames));
    for (const std::size_t length : {199U, 200U, 201U, 254U, 255U, 256U, 300U})
        for (const char* piece : {"a", "b", "%", "ü", "."}) {
            std::string name;
            while (name.size() < length) name += piece;
            names.insert(name);
        }
    for (char c = 1; names.size() < 200; ++c)
        names.insert(std::string("n") + c + (c % 2 == 0 ? "/.." : ""));
    return {names.begin(), names.end()};
}

}  // namespace splat::test
