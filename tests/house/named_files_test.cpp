// Comments name files that exist, and installed files name installed files only.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

/// Words that look like a path of this repository (`src/...` and its like) or like the name of one of
/// its text files. Those with a placeholder in them (`<stem>`, `*`, `foo`, `a.h`) are left out.
std::vector<std::string> names_in(const std::string& text) {
    static const std::set<std::string> roots = {"bindings", "cmake", "include", "shaders",
                                                "src",      "tests", "tools"};
    static const std::set<std::string> extensions = {"awk",  "c", "cmake", "comp", "cpp", "cs",
                                                     "glsl", "h", "md",    "py",   "rs",  "sh"};
    std::vector<std::string> names;
    std::string word;
    for (std::size_t i = 0; i <= text.size(); ++i) {
        const char c = i < text.size() ? text[i] : ' ';
        const bool part = std::isalnum(static_cast<unsigned char>(c)) != 0 || (c & 0x80) != 0 ||
                          std::string("_./-*<>{}$@+~:%").find(c) != std::string::npos;
        if (part) {
            word += c;
            continue;
        }
        while (!word.empty() && std::string("./:-").find(word.back()) != std::string::npos)
            word.pop_back();
        const bool plain = std::all_of(word.begin(), word.end(), [](char of) {
            return std::isalnum(static_cast<unsigned char>(of)) != 0 || of == '_' || of == '.' ||
                   of == '/' || of == '-';
        });
        const std::string stem = stem_of(word);
        const bool rooted =
            roots.count(word.substr(0, word.find('/'))) != 0 && word.find('/') != std::string::npos;
        const bool named = stem.size() > 1 && stem.find('.') == std::string::npos &&
                           extensions.count(extension_of(word)) != 0;
        const bool placeholder = word.find("..") != std::string::npos || starts_with(stem, "foo") ||
                                 starts_with(word, "/");
        if (plain && !placeholder && (rooted || named)) names.push_back(word);
        word.clear();
    }
    return names;
}

/// The paths of the repository, and what is left of each behind any of its slashes.
std::set<std::string> endings_of(const std::vector<TextFile>& files) {
    std::set<std::string> endings;
    for (const TextFile& file : files)
        for (std::string path = file.path; !path.empty(); path = folder_of(path)) {
            endings.insert(path);
            for (std::size_t slash = path.find('/'); slash != std::string::npos;
                 slash = path.find('/', slash + 1))
                endings.insert(path.substr(slash + 1));
        }
    return endings;
}

/// Files of other programs, and those that a build or a run makes.
const std::set<std::string>& foreign() {
    static const std::set<std::string> names = {"jpeglib.h", "pickletools.py"};
    return names;
}

Findings check_comments(const TextFile& file, const std::set<std::string>& endings) {
    Findings findings;
    const std::vector<std::string> comments = comments_of(file);
    for (std::size_t i = 0; i < comments.size(); ++i)
        for (const std::string& name : names_in(comments[i]))
            if (endings.count(name) == 0 && foreign().count(name) == 0)
                findings.push_back(at(file, i,
                                      "the comment names " + name +
                                          ", which is not a file or folder here; was it moved?"));
    return findings;
}

/// What `cmake --install` copies: these files, and the folder of weights (cmake/SplatInstall.cmake).
bool is_installed(const std::string& path) {
    static const std::set<std::string> files = {"cmake/SplatConfig.cmake.in", "cmake/splat.pc.in"};
    return files.count(path) != 0 || (starts_with(path, "include/") && ends_with(path, ".h")) ||
           starts_with(path, "tools/weights/cars64/");
}

/// An installed file names no file of the repository that is not installed.
Findings check_installed(const TextFile& file, const std::set<std::string>& staying) {
    Findings findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; is_installed(file.path) && i < lines.size(); ++i)
        for (const std::string& name : names_in(lines[i]))
            if (staying.count(name) != 0)
                findings.push_back(at(file, i, "names " + name + ", which is not installed"));
    return findings;
}

/// endings_of the files that are not installed, without those that installed files share.
std::set<std::string> staying_of(const std::vector<TextFile>& files) {
    std::vector<TextFile> installed, others;
    for (const TextFile& file : files)
        (is_installed(file.path) ? installed : others).push_back({file.path, ""});
    std::set<std::string> staying = endings_of(others);
    for (const std::string& ending : endings_of(installed)) staying.erase(ending);
    return staying;
}

TEST(NamedFiles, ExistWhereCommentsNameThem) {
    const std::set<std::string> endings = endings_of(repository());
    Findings findings;
    for (const TextFile& file : repository())
        for (const std::string& finding : check_comments(file, endings))
            findings.push_back(finding);
    expect_none(findings);
}

TEST(NamedFiles, OfInstalledFilesAreInstalled) {
    const std::set<std::string> staying = staying_of(repository());
    std::size_t installed = 0;
    for (const TextFile& file : repository()) {
        installed += is_installed(file.path) ? 1U : 0U;
        expect_none(check_installed(file, staying));
    }
    EXPECT_GT(installed, 9U);
}

TEST(NamedFiles, RuleFindsFilesThatAreGone) {
    const std::set<std::string> endings =
        endings_of({{"src/raster/project.cpp", ""}, {"tests/raster/project_test.cpp", ""}});
    const auto check = [&](const char* path, const char* text) {
        return check_comments({path, text}, endings);
    };
    expect_none(
        check("src/a.cpp", "// see raster/project.cpp, src/raster and project_test.cpp.\n"));
    expect_none(
        check("src/a.cpp", "open(\"src/gone.cpp\"); // of <stem>_test.cpp, tests/*/gone.h\n"));
    expect_none(check("src/a.cpp", "// foo.cpp, a.h, k.0.c, src/.../gone.cpp, /usr/gone.h\n"));
    expect_found(check("src/a.cpp", "int x;\n/* in\n * src/gone/x.cpp */\n"), 1,
                 "src/a.cpp:3: the comment names src/gone/x.cpp");
    expect_found(check("src/a.h", "int x; // gone_test.cpp says\n"), 1, "gone_test.cpp");
    expect_found(check("shaders/a.comp", "// raster/gone.cpp\n"), 1, "raster/gone.cpp");
    expect_found(check("tests/CMakeLists.txt", "add() # of tests/gone\n"), 1, "tests/gone");
    expect_found(check("tools/run", "#!/bin/sh\n# sources gone.sh\n"), 1, "gone.sh");
    expect_found(check("tools/a.py", "# of gone.py\n"), 1, "gone.py");
    expect_found(check("bindings/a.rs", "//! Of gone.rs\n"), 1, "gone.rs");
    expect_found(check("bindings/a.cs", "int x; // Gone.cs\n"), 1, "Gone.cs");
    expect_found(check("src/a.h", "// bindings/gone\n"), 1, "bindings/gone");
}

TEST(NamedFiles, RuleFindsWhatIsNotInstalled) {
    const std::set<std::string> staying = staying_of({{"include/splat.h", ""},
                                                      {"README.md", ""},
                                                      {"BENCHMARKS.md", ""},
                                                      {"src/model/config_file.h", ""},
                                                      {"tools/weights/cars64/README.md", ""}});
    const auto check = [&](const char* text) {
        return check_installed({"include/splat.h", text}, staying);
    };
    expect_none(check("/* splat.h needs <stddef.h>; cars64/README.md */\n"));
    expect_found(check("/* keys:\n * src/model/config_file.h */\n"), 1,
                 "splat.h:2: names src/model");
    expect_found(check("/* figures in BENCHMARKS.md */\n"), 1, "BENCHMARKS.md");
    expect_none(check_installed({"src/a.h", "// BENCHMARKS.md\n"}, staying));
}

}  // namespace
}  // namespace splat::house
