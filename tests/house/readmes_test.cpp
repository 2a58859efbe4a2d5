// Every folder has a short README whose paths exist. No file contains an absolute path of one
// machine.

#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

constexpr std::size_t kMaxReadmeLines = 60;
/// What a visitor reads first, and two lists to look things up in: of the sources, and of commands.
const std::set<std::string> kLongReadmes = {"README.md", "src/README.md", "tools/vkrun/README.md"};
constexpr std::size_t kMaxLongReadmeLines = 130;

/// All files and folders.
std::set<std::string> paths_of(const std::vector<TextFile>& files) {
    std::set<std::string> paths;
    for (const TextFile& file : files)
        for (std::string path = file.path; !path.empty(); path = folder_of(path))
            paths.insert(path);
    return paths;
}

/// A folder with sources has a README.md. Below tests, shaders and tools the README of a folder above is
/// enough.
Findings check_presence(const std::vector<TextFile>& files) {
    const std::set<std::string> paths = paths_of(files);
    std::set<std::string> missing;
    for (const TextFile& file : files) {
        const std::string folder = folder_of(file.path);
        if (!is_source(file.path) || folder == "include" || paths.count(folder + "/README.md") != 0)
            continue;
        std::string above = folder_of(folder);
        while (!above.empty() && paths.count(above + "/README.md") == 0) above = folder_of(above);
        if (above.empty() || starts_with(folder, "src/")) missing.insert(folder);
    }
    // A language is a folder below bindings/.
    for (const TextFile& file : files) {
        if (!is_binding(file.path)) continue;
        const std::string language = file.path.substr(0, file.path.find('/', sizeof "bindings/"));
        if (paths.count(language + "/README.md") == 0) missing.insert(language);
    }
    Findings findings;
    for (const std::string& folder : missing)
        findings.push_back("there is no " + folder + "/README.md");
    return findings;
}

Findings check_length(const TextFile& file) {
    const std::size_t count = lines_of(file.text).size();
    const std::size_t limit =
        kLongReadmes.count(file.path) != 0 ? kMaxLongReadmeLines : kMaxReadmeLines;
    if (name_of(file.path) != "README.md" || count <= limit) return {};
    return {file.path + ": " + std::to_string(count) + " lines, limit " + std::to_string(limit)};
}

/// A path in backquotes such as `src/...` exists, from the root or from the file's folder. Paths with a
/// placeholder are exempt.
Findings check_paths(const TextFile& file, const std::set<std::string>& paths) {
    static const std::regex quoted(
        R"re(`((?:src|shaders|tests|tools|include|cmake|bindings)/[A-Za-z0-9_./-]*)`)re");
    Findings findings;
    if (extension_of(file.path) != "md" || file.path == "CHANGELOG.md") return findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
        for (std::sregex_iterator it(lines[i].begin(), lines[i].end(), quoted), end; it != end;
             ++it) {
            std::string path = (*it)[1];
            if (ends_with(path, "/")) path.pop_back();
            const bool placeholder = std::regex_search(path, std::regex(R"(\bfoo|\.\.\.)"));
            const std::string local = folder_of(file.path) + "/" + path;
            if (!placeholder && paths.count(path) == 0 && paths.count(local) == 0)
                findings.push_back(at(file, i, "there is no " + path));
        }
    return findings;
}

/// Absolute paths, such as a home folder.
Findings check_machine(const TextFile& file) {
    static const std::regex machine(std::string("(^|[^A-Za-z0-9_.}/-])/(ro") + "ot|ho" + "me|wo" +
                                    "rk)/");
    Findings findings;
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (lines[i].find('/') != std::string::npos && std::regex_search(lines[i], machine))
            findings.push_back(at(file, i, "a path of one machine"));
    return findings;
}

TEST(Readmes, EveryFolderHasOne) {
    expect_none(check_presence(repository()));
}

TEST(Readmes, AreShortAndNameWhatExists) {
    const std::set<std::string> paths = paths_of(repository());
    for (const TextFile& file : repository()) {
        expect_none(check_length(file));
        expect_none(check_paths(file, paths));
    }
}

TEST(Readmes, NoFileHasAPathOfOneMachine) {
    for (const TextFile& file : repository()) expect_none(check_machine(file));
}

TEST(Readmes, RuleFindsMissingOnes) {
    expect_found(check_presence({{"src/README.md", ""}, {"src/core/a.cpp", ""}}), 1,
                 "src/core/README");
    expect_found(check_presence({{"tests/ops/a.cpp", ""}}), 1, "tests/ops/README");
    expect_none(check_presence({{"tests/README.md", ""}, {"tests/ops/a.cpp", ""}}));
    expect_none(check_presence({{"src/core/README.md", ""}, {"src/core/a.cpp", ""}}));
    expect_found(check_presence({{"bindings/README.md", ""}, {"bindings/x/src/a.py", ""}}), 1,
                 "no bindings/x/README.md");
    expect_none(check_presence({{"bindings/x/README.md", ""}, {"bindings/x/src/a.py", ""}}));
}

TEST(Readmes, RuleFindsLongOnes) {
    const auto lines = [](int count) {
        std::string text;
        for (int i = 0; i < count; ++i) text += "line\n";
        return text;
    };
    expect_found(check_length({"src/core/README.md", lines(61)}), 1, "61 lines");
    expect_none(check_length({"CHANGELOG.md", lines(200)}));
    for (const std::string& file : kLongReadmes) {
        expect_none(check_length({file, lines(130)}));
        expect_found(check_length({file, lines(131)}), 1, "131 lines, limit 130");
    }
}

TEST(Readmes, RuleFindsPathsThatAreGone) {
    const std::set<std::string> paths = paths_of({{"src/core/status.cpp", ""}});
    const std::string text =
        "`src/core/status.cpp`, `src/core/`, `src/ops/foo.cpp`\n| `src/core/gone.cpp` |\n";
    expect_found(check_paths({"README.md", text}, paths), 1,
                 "README.md:2: there is no src/core/gone");
}

TEST(Readmes, RuleFindsMachinePaths) {
    const std::string home = std::string("/ho") + "me/";
    expect_found(check_machine({"a.sh", "cd " + home + "someone\n"}), 1, "a.sh:1");
    expect_found(check_machine({"a.cpp", "\nopen(\"/wo" + std::string("rk/x\");\n")}), 1,
                 "a.cpp:2");
    expect_none(check_machine({"a.sh", "cd $prefix" + home + "x; cd frame/wo" + "rk/x\n"}));
}

}  // namespace
}  // namespace splat::house
