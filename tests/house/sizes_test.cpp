// Limits on files, functions, lines and folders, and names that say nothing.

#include <gtest/gtest.h>

#include <map>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

constexpr std::size_t kMaxColumns = 120;
constexpr std::size_t kMaxFunctionLines = 80;
constexpr std::size_t kMaxStemsPerFolder = 30;

/// Most lines of a file; 0 = no limit.
std::size_t max_lines(const std::string& path) {
    if (starts_with(path, "include/")) return 600;  // with the documentation of the API
    const std::string extension = extension_of(path);
    if (extension == "cpp" || extension == "c") return 500;
    if (extension == "h") return starts_with(path, "tests/") ? 500 : 250;
    if (extension == "comp" || extension == "glsl") return 250;
    if (is_binding(path)) return 500;
    return 0;
}

bool has_line_limit(const std::string& path) {
    const std::string extension = extension_of(path);
    return is_source(path) || is_binding(path) || extension == "cmake" || extension == "sh" ||
           extension == "in" || name_of(path) == "CMakeLists.txt" || path == "tools/test" ||
           path == "tools/demo";
}

/// Characters, not bytes, of UTF-8 text.
std::size_t columns(const std::string& line) {
    std::size_t count = 0;
    for (const char c : line)
        if ((static_cast<unsigned char>(c) & 0xC0U) != 0x80U) ++count;
    return count;
}

Findings check_lines(const TextFile& file) {
    Findings findings;
    if (is_generated(file)) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    if (max_lines(file.path) != 0 && lines.size() > max_lines(file.path))
        findings.push_back(file.path + ": " + std::to_string(lines.size()) + " lines, limit " +
                           std::to_string(max_lines(file.path)) + "; split it by stage");
    if (!has_line_limit(file.path)) return findings;
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (columns(lines[i]) > kMaxColumns)
            findings.push_back(at(file, i,
                                  std::to_string(columns(lines[i])) + " columns, limit " +
                                      std::to_string(kMaxColumns)));
    return findings;
}

/// A function starts on a line without indentation that opens a brace, and ends with a brace in the
/// first column: the layout that clang-format gives to everything at namespace level.
Findings check_functions(const TextFile& file) {
    Findings findings;
    if (!is_source(file.path)) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    const std::set<std::string> others = {"namespace", "struct", "class",
                                          "enum",      "union",  "extern"};
    std::size_t start = 0;
    bool inside = false;
    std::size_t signature = 0;
    for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string& line = lines[i];
        const bool indented = line.empty() || line[0] == ' ' || line[0] == '\t' || line[0] == '#' ||
                              line[0] == '/' || line[0] == '}';
        if (!inside && !indented) signature = i;
        if (!inside && ends_with(line, "{") && !starts_with(line, "#") && !starts_with(line, "/")) {
            const std::string first = lines[signature].substr(0, lines[signature].find(' '));
            inside = others.count(first) == 0;
            start = signature;
        } else if (inside && starts_with(line, "}")) {
            inside = false;
            if (i - start + 1 > kMaxFunctionLines)
                findings.push_back(at(file, start,
                                      "a function of " + std::to_string(i - start + 1) +
                                          " lines, limit " + std::to_string(kMaxFunctionLines)));
        }
    }
    return findings;
}

/// Python's functions end where a line is indented no deeper than `def`, Rust's with a brace below `fn`.
Findings check_binding_functions(const TextFile& file) {
    const bool python = extension_of(file.path) == "py";
    Findings findings;
    if (!is_binding(file.path) || is_generated(file)) return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    const auto indent = [&](std::size_t i) { return lines[i].find_first_not_of(' '); };
    for (std::size_t start = 0; start < lines.size(); ++start) {
        const std::string code = lines[start].substr(std::min(indent(start), lines[start].size()));
        const bool begins = python ? starts_with(code, "def ") || starts_with(code, "async def ")
                                   : extension_of(file.path) == "rs" &&
                                         (" " + code).find(" fn ") != std::string::npos &&
                                         !starts_with(code, "//") && !ends_with(code, ";");
        if (!begins) continue;
        std::size_t last = start;
        for (std::size_t i = start + 1; i < lines.size(); ++i) {
            if (indent(i) == std::string::npos) continue;
            const bool closing = lines[i][indent(i)] == ')' || lines[i][indent(i)] == '}';
            if (indent(i) <= indent(start) && !closing) break;
            last = i;
            if (!python && indent(i) == indent(start) && lines[i][indent(i)] == '}') break;
        }
        if (last - start + 1 > kMaxFunctionLines)
            findings.push_back(at(file, start,
                                  "a function of " + std::to_string(last - start + 1) +
                                      " lines, limit " + std::to_string(kMaxFunctionLines)));
    }
    return findings;
}

Findings check_name(const TextFile& file) {
    static const std::set<std::string> vague = {"util", "utils", "helper",    "helpers",
                                                "misc", "tools", "functions", "stuff"};
    const std::string stem = stem_of(file.path);
    const std::string last = stem.substr(stem.rfind('_') + 1);
    if ((is_source(file.path) || is_binding(file.path)) &&
        (vague.count(last) != 0 || name_of(file.path) == "common.cpp"))
        return {file.path + ": a name that says nothing; name the file after its contents"};
    return {};
}

/// Stems per folder: a.h and a.cpp count once, and so do the shaders of one op.
Findings check_folders(const std::vector<TextFile>& files) {
    std::map<std::string, std::set<std::string>> stems;
    for (const TextFile& file : files) {
        std::string stem = stem_of(file.path);
        for (const char* direction : {"_forward", "_backward"})
            stem = stem.substr(0, stem.find(direction));
        if (is_source(file.path) || is_binding(file.path)) stems[folder_of(file.path)].insert(stem);
    }
    Findings findings;
    for (const auto& [folder, names] : stems)
        if (names.size() > kMaxStemsPerFolder)
            findings.push_back(folder + ": " + std::to_string(names.size()) + " stems, limit " +
                               std::to_string(kMaxStemsPerFolder));
    return findings;
}

Findings check_sizes(const std::vector<TextFile>& files) {
    Findings findings = check_folders(files);
    for (const TextFile& file : files)
        for (const auto& rule : {check_lines, check_functions, check_binding_functions, check_name})
            for (const std::string& finding : rule(file)) findings.push_back(finding);
    return findings;
}

std::string repeated(const std::string& text, std::size_t count) {
    std::string all;
    for (std::size_t i = 0; i < count; ++i) all += text;
    return all;
}

TEST(Sizes, RepositoryIsWithinLimits) {
    expect_none(check_sizes(repository()));
}

TEST(Sizes, RuleAcceptsTheLimitItself) {
    expect_none(check_sizes({{"src/core/a.cpp", repeated("x\n", 500)}}));
    expect_none(check_sizes({{"src/core/a.cpp", repeated("x", 120) + "\n"}}));
    expect_none(check_sizes({{"src/core/a.cpp", repeated("\xC3\xA9", 120) + "\n"}}));
    expect_none(
        check_sizes({{"src/core/a.cpp", "int f() {\n" + repeated("    x;\n", 78) + "}\n"}}));
    expect_none(
        check_sizes({{"src/core/a.cpp", "namespace a {\n" + repeated("int x;\n", 90) + "}\n"}}));
    expect_none(check_sizes({{"README.md", repeated("x", 200)}, {"shaders/common.glsl", ""}}));
}

TEST(Sizes, RuleFindsLongFiles) {
    expect_found(check_sizes({{"src/core/a.cpp", repeated("x\n", 501)}}), 1,
                 "501 lines, limit 500");
    expect_found(check_sizes({{"src/core/a.h", repeated("x\n", 251)}}), 1, "limit 250");
    expect_found(check_sizes({{"shaders/ops/a.comp", repeated("x\n", 251)}}), 1, "limit 250");
    expect_found(check_sizes({{"include/splat/core.h", repeated("x\n", 601)}}), 1, "limit 600");
    const std::string long_text = repeated("x\n", 501);
    for (const char* path : {"bindings/python/src/libsplat/scene.py", "bindings/rust/splat/src/lib.rs",
                             "bindings/csharp/Scene.cs", "bindings/c/fit.c"})
        expect_found(check_sizes({{path, long_text}}), 1, "limit 500");
    expect_none(check_sizes({{"bindings/csharp/Native.cs", "// Generated by x\n" + long_text}}));
}

TEST(Sizes, RuleFindsLongLines) {
    expect_found(check_sizes({{"src/core/a.h", "\n// " + repeated("x", 118)}}), 1,
                 "a.h:2: 121 columns");
    expect_found(check_sizes({{"src/CMakeLists.txt", repeated("x", 121)}}), 1, "121 columns");
    expect_found(check_sizes({{"bindings/api/a.py", repeated("x", 121)}}), 1, "121 columns");
}

TEST(Sizes, RuleFindsLongFunctions) {
    const std::string body = repeated("    x;\n", 79) + "}\n";
    expect_found(check_sizes({{"src/core/a.cpp", "int f() {\n" + body}}), 1,
                 "a.cpp:1: a function of 81");
    expect_found(check_sizes({{"src/core/a.cpp", "\nint f(int a,\n      int b) {\n" + body}}), 1,
                 "a.cpp:2: a function of 82");
    expect_found(check_sizes({{"shaders/ops/a.comp", "void main() {\n" + body}}), 1, "81 lines");
    const std::string in_class = "class A:\n    def f(\n        a\n    ):\n";
    const std::string deeper = repeated("        x\n\n", 39);
    expect_none(check_sizes({{"bindings/a.py", in_class + deeper + "\n    y = 1\n"}}));
    expect_found(check_sizes({{"bindings/a.py", in_class + deeper + "        x\n"}}), 1,
                 "a.py:2: a function of 82");
    const std::string method = "impl A {\n    pub fn f(\n        a: u32,\n    ) {\n";
    const std::string end = "    }\n}\n";
    expect_none(check_sizes({{"bindings/a.rs", method + repeated("        x\n", 76) + end}}));
    expect_found(check_sizes({{"bindings/a.rs", method + repeated("        x\n", 77) + end}}), 1,
                 "a.rs:2: a function of 81");
}

TEST(Sizes, RuleFindsVagueNames) {
    for (const char* path : {"src/core/utils.h", "src/vk/helpers.cpp", "src/io/misc.cpp",
                             "src/ops/common.cpp", "src/ops/conv2d_utils.cpp"})
        expect_found(check_sizes({{path, ""}}), 1, "says nothing");
}

TEST(Sizes, RuleFindsCrowdedFolders) {
    std::vector<TextFile> files;
    for (int i = 0; i < 30; ++i)
        for (const char* extension : {".h", ".cpp"})
            files.push_back({"src/ops/op" + std::to_string(i) + extension, ""});
    expect_none(check_sizes(files));
    files.push_back({"src/ops/one_more.cpp", ""});
    expect_found(check_sizes(files), 1, "31 stems");
}

}  // namespace
}  // namespace splat::house
