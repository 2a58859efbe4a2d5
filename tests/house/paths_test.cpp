// Names of files are UTF-8 in src/ and tools/. The standard library would take them for texts of Windows' code page:
// they become paths, and paths texts, by core/os/path.h alone.

#include <gtest/gtest.h>

#include <regex>

#include "house/repo.h"

namespace splat::house {
namespace {

Findings check_paths(const std::vector<TextFile>& files) {
    static const std::regex made(R"(\b(fs|filesystem)::path( \w+)?\((?!const )\w)");
    static const std::regex text(R"((\.|->)(generic_)?string\(\)|(\.|->)native\(\))");
    static const std::regex opened(R"(\b(fopen|freopen)\()");
    Findings findings;
    for (const TextFile& file : files) {
        if ((!starts_with(file.path, "src/") && !starts_with(file.path, "tools/")) ||
            !is_source(file.path) || starts_with(file.path, "src/core/os/"))
            continue;
        const std::string code = without_comments(file.text);
        const std::vector<std::string> lines = lines_of(code);
        const bool uses = code.find("std::filesystem") != std::string::npos;
        if (uses && file.text.find("\"core/os/path.h\"") == std::string::npos)
            findings.push_back(at(file, 0, "std::filesystem without core/os/path.h"));
        for (std::size_t i = 0; i < lines.size(); ++i) {
            if (std::regex_search(lines[i], made))
                findings.push_back(at(file, i, "a path of a text: use os::path_of"));
            if (std::regex_search(lines[i], text))
                findings.push_back(at(file, i, "a text of a path: use os::text_of"));
            if (std::regex_search(lines[i], opened))
                findings.push_back(at(file, i, "a name that is not UTF-8: use core/os/file.h"));
        }
    }
    return findings;
}

Findings check_path(const std::string& line) {
    return check_paths({{"src/io/a.cpp", line + "\n"}});
}

TEST(Paths, RepositoryFollowsTheRule) {
    expect_none(check_paths(repository()));
}

TEST(Paths, RuleAcceptsTheFunctions) {
    expect_none(check_path("const fs::path path = os::path_of(name);"));
    expect_none(check_path("return os::text_of(folder / name);"));
    expect_none(check_path("using Write = std::function<Status(const fs::path&)>;"));
    expect_none(check_path("// fs::path(name).string()"));
    expect_none(check_paths({{"src/core/os/path_posix.cpp", "return fs::path(text).string();"}}));
    expect_none(check_paths({{"tests/a_test.cpp", "return fs::path(text).string();"}}));
}

TEST(Paths, RuleFindsOthers) {
    expect_found(check_path("const auto path = fs::path(name);"), 1, "a.cpp:1: a path of a text");
    expect_found(check_path("const fs::path path(name);"), 1, "os::path_of");
    expect_found(check_paths({{"tools/vkrun/a.cpp", "const fs::path path(name);"}}), 1,
                 "os::path_of");
    expect_found(check_path("return path.string();"), 1, "os::text_of");
    expect_found(check_path("return entry->string();"), 1, "os::text_of");
    expect_found(check_path("std::FILE* file = std::fopen(name, \"rb\");"), 1, "core/os/file.h");
    expect_found(check_path("#include <string>\nstd::filesystem::path path;"), 1, "without");
}

}  // namespace
}  // namespace splat::house
