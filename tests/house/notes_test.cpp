// A comment says what it is about: none begins in the middle of a sentence.

#include <gtest/gtest.h>

#include <regex>

#include "house/repo.h"

namespace splat::house {
namespace {

/// First lines of comments that begin with "of", "as", "its", "those", "that", "also" or "and", so that a reader must
/// guess the subject.
Findings check_notes(const TextFile& file) {
    static const std::regex elliptical(R"([/<!*\s]*(<summary>)?(of|as|its|those|that|also|and)\b)",
                                       std::regex::icase);
    static const std::regex docstring(R"re(\s*r?"""(of|as|its|those|that|also|and)\b)re",
                                      std::regex::icase);
    const auto is = [](const std::string& text, const std::regex& begin) {
        return std::regex_search(text, begin, std::regex_constants::match_continuous);
    };
    const std::vector<std::string> lines = lines_of(file.text);
    const std::vector<std::string> comments = comments_of(file);
    const auto indent = [&](std::size_t i) { return lines[i].find_first_not_of(" \t"); };
    const auto alone = [&](std::size_t i) {  // no code in front of the comment
        return comments[i] == lines[i] || std::string("/#*").find(lines[i][indent(i)]) < 3;
    };
    Findings findings;
    for (std::size_t i = 0; i < comments.size(); ++i) {
        // A comment below another goes on with it, unless it has the indentation of code with a note.
        const bool goes_on = i > 0 && !comments[i].empty() && !comments[i - 1].empty() &&
                             alone(i) && (alone(i - 1) || indent(i) != indent(i - 1));
        if ((!goes_on && is(comments[i], elliptical)) ||
            (extension_of(file.path) == "py" && is(lines[i], docstring)))
            findings.push_back(at(file, i, "the comment has no subject: " + lines[i]));
    }
    return findings;
}

TEST(Notes, OfTheRepositoryHaveSubjects) {
    Findings findings;
    for (const TextFile& file : repository())
        for (const std::string& finding : check_notes(file)) findings.push_back(finding);
    expect_none(findings);
}

TEST(Notes, RuleFindsThoseWithout) {
    const auto check = [](const char* path, const char* text) { return check_notes({path, text}); };
    for (const char* text :
         {"/// Of a sample; 0 for an unknown type.\nint f();\n", "int a;  ///< of the file\n",
          "int a;  // as Linux\n", "/* its name */\nint a;\n", "int a;  /* those of b */\n",
          "int a;  ///< bytes\n/// Also b.\nint b;\n",
          "int a;  ///< bytes\nint b;  ///< and fills\n"})
        expect_found(check("src/a.h", text), 1, "no subject");
    expect_found(check("bindings/a.py", "a = 1  # that of b\n"), 1, "a.py:1:");
    expect_found(check("bindings/a.py", "def f():\n    \"\"\"As g().\"\"\"\n"), 1, "a.py:2:");
    expect_found(check("bindings/a.rs", "    /// Its name.\n"), 1, "a.rs:1:");
    expect_found(check("bindings/A.cs", "/// <summary>Of Adam.</summary>\n"), 1, "A.cs:1:");
    expect_none(
        check("src/a.h", "int a;  ///< bytes\n        ///< of a file\n/// The sum\n/// of b.\n"));
    expect_none(
        check("src/a.h", "/* Bytes\n * of a file */\nint a;\nputs(\"// of b\");\n/// Assigns.\n"));
}

}  // namespace
}  // namespace splat::house
