// Rules for the text of include/splat.h that no compiler checks.

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

Findings check_header(const std::string& header) {
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
    const std::string code = without_comments(header);
    Findings findings;
    for (const Word& word : words)
        if (std::regex_search(code, word.pattern))
            findings.push_back(std::string("include/splat.h has ") + word.why);
    const std::set<std::string> allowed = {"<stddef.h>", "<stdint.h>"};
    for (const std::string& name : matches(code, std::regex(R"(#\s*include\s*(\S+))")))
        if (allowed.count(name) == 0) findings.push_back("include/splat.h includes " + name);
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
    const std::string& header = repository_file("include/splat.h").text;
    expect_none(check_header(header));
    expect_none(check_unit(header, repository_file("tests/house/header_unit.c").text));
}

TEST(PublicHeader, RuleFindsWhatBindingsCannotCarry) {
    expect_none(check_header("#include <stdint.h>\n/* bool */ enum { SPLAT_A = 1 };\n"));
    expect_found(check_header("#include <stdbool.h>\n"), 1, "<stdbool.h>");
    expect_found(check_header("SPLAT_API bool splat_a(void);\n"), 1, "varying size");
    expect_found(check_header("SPLAT_API int splat_a(const char* text, ...);\n"), 1,
                 "variable arg");
    expect_found(check_header("typedef enum splat_a { SPLAT_B } splat_a;\n"), 1, "named C enum");
    expect_found(check_header("typedef struct splat_a { uint32_t b : 3; } splat_a;\n"), 1,
                 "bit-field");
}

TEST(PublicHeader, RuleFindsStructsNotSampled) {
    const std::string header = "typedef struct splat_a {\n int x;\n} splat_a;\n";
    expect_none(check_unit(header, "splat_a sample_a;\n"));
    expect_found(check_unit(header, "splat_b sample_b;\n"), 1, "splat_a");
}

}  // namespace
}  // namespace splat::house
