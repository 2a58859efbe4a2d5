// Rules for the text of the public headers that no compiler checks.

#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

std::set<std::string> matches(const std::string& text, const std::regex& pattern) {
    std::set<std::string> found;
    for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it)
        found.insert((*it)[1]);
    return found;
}

/// A function without a comment of its own above it.
Findings check_docstrings(const TextFile& header) {
    Findings findings;
    const std::vector<std::string> lines = lines_of(header.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (starts_with(lines[i], "SPLAT_API ") && (i == 0 || !ends_with(lines[i - 1], "*/")))
            findings.push_back(at(header, i, "a function without a docstring of its own"));
    return findings;
}

Findings check_header(const TextFile& header) {
    struct Word {
        std::regex pattern;
        const char* why;
    };
    static const Word words[] = {
        {std::regex(R"(\b(bool|long|wchar_t|size_t\s*:\s*\d)\b)"), "a type of varying size"},
        {std::regex(R"(\bunion\b)"), "a union"},
        {std::regex(R"(\btypedef\s+enum\b|\benum\s+\w+)"), "a named C enum"},
        {std::regex(R"(,\s*\.\.\.\s*\))"), "variable arguments"},
        {std::regex(R"(\w\s*:\s*\d+\s*;)"), "a bit-field"},
    };
    const std::string code = without_comments(header.text);
    Findings findings = check_docstrings(header);
    for (const Word& word : words)
        if (std::regex_search(code, word.pattern))
            findings.push_back(header.path + " has " + word.why);
    static const std::regex allowed(R"(<std(def|int)\.h>|"(splat/)?\w+\.h")");
    for (const std::string& name : matches(code, std::regex(R"(#\s*include\s*(\S+))")))
        if (!std::regex_match(name, allowed)) findings.push_back(header.path + " includes " + name);
    return findings;
}

/// Structs of the header without a variable in the unit.
Findings check_unit(const std::string& header, const std::string& unit) {
    Findings findings;
    const std::set<std::string> sampled = matches(unit, std::regex(R"((splat_\w+) sample_\w+;)"));
    for (const std::string& name :
         matches(without_comments(header), std::regex(R"(typedef struct (\w+) \{)")))
        if (sampled.count(name) == 0)
            findings.push_back("tests/house/header_unit.c has no variable of " + name);
    return findings;
}

TEST(PublicHeader, FollowsTheRules) {
    std::size_t headers = 0;
    for (const TextFile& file : repository()) {
        if (!starts_with(file.path, "include/") || !is_source(file.path)) continue;
        ++headers;
        expect_none(check_header(file));
        expect_none(check_unit(file.text, repository_file("tests/house/header_unit.c").text));
    }
    EXPECT_EQ(headers, 17U);
}

TEST(PublicHeader, RuleFindsWhatBindingsCannotCarry) {
    const auto check = [](const char* text) { return check_header({"include/a.h", text}); };
    expect_none(check("#include <stdint.h>\n/* bool */ enum { SPLAT_A = 1 };\n"));
    expect_none(check("#include \"core.h\"\n/* Effect. */\nSPLAT_API int splat_a(void);\n"));
    expect_found(check("#include <stdbool.h>\n"), 1, "<stdbool.h>");
    expect_found(check("/* Effect. */\nSPLAT_API bool splat_a(void);\n"), 1, "varying size");
    expect_found(check("/* Effect. */\nSPLAT_API int splat_a(const char* text, ...);\n"), 1,
                 "variable arg");
    expect_found(check("typedef enum splat_a { SPLAT_B } splat_a;\n"), 1, "named C enum");
    expect_found(check("typedef struct splat_a { uint32_t b : 3; } splat_a;\n"), 1, "bit-field");
    expect_found(check("/* Effect. */\nSPLAT_API int splat_a(void);\nSPLAT_API int b(void);\n"), 1,
                 "a.h:3: a function without a docstring");
}

TEST(PublicHeader, RuleFindsStructsNotSampled) {
    const std::string header = "typedef struct splat_a {\n int x;\n} splat_a;\n";
    expect_none(check_unit(header, "splat_a sample_a;\n"));
    expect_found(check_unit(header, "splat_b sample_b;\n"), 1, "splat_a");
}

}  // namespace
}  // namespace splat::house
