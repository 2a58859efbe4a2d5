#include "house/repo.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

namespace splat::house {
namespace {

namespace fs = std::filesystem;

std::vector<TextFile> read_repository() {
    const fs::path root = SPLAT_SOURCE_DIR;
    const std::set<std::string> skipped = {".git", ".cache", "build", "shared"};
    std::vector<TextFile> files;
    for (auto it = fs::recursive_directory_iterator(root); it != fs::recursive_directory_iterator();
         ++it) {
        if (it->is_directory() && it.depth() == 0 && skipped.count(it->path().filename().string()))
            it.disable_recursion_pending();
        if (!it->is_regular_file() || it->path().filename() == ".git")
            continue;  // a file in worktrees
        std::ifstream stream(it->path(), std::ios::binary);
        std::string text{std::istreambuf_iterator<char>(stream), {}};
        if (text.find('\0') != std::string::npos) text.clear();
        files.push_back({fs::relative(it->path(), root).generic_string(), std::move(text)});
    }
    std::sort(files.begin(), files.end(),
              [](const TextFile& a, const TextFile& b) { return a.path < b.path; });
    return files;
}

}  // namespace

const std::vector<TextFile>& repository() {
    static const std::vector<TextFile> files = read_repository();
    return files;
}

const TextFile& repository_file(const std::string& path) {
    static const TextFile none;
    for (const TextFile& file : repository())
        if (file.path == path) return file;
    ADD_FAILURE() << "there is no " << path;
    return none;
}

std::vector<std::string> lines_of(std::string_view text) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const std::size_t end = std::min(text.find('\n'), text.size());
        lines.emplace_back(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    return lines;
}

bool starts_with(std::string_view text, std::string_view prefix) {
    return text.substr(0, prefix.size()) == prefix;
}

bool ends_with(std::string_view text, std::string_view suffix) {
    return text.size() >= suffix.size() && text.substr(text.size() - suffix.size()) == suffix;
}

std::string folder_of(std::string_view path) {
    const std::size_t slash = path.rfind('/');
    return slash == std::string_view::npos ? "" : std::string(path.substr(0, slash));
}

std::string name_of(std::string_view path) {
    const std::size_t slash = path.rfind('/');
    return std::string(slash == std::string_view::npos ? path : path.substr(slash + 1));
}

std::string stem_of(std::string_view path) {
    const std::string name = name_of(path);
    return name.substr(0, name.rfind('.'));
}

std::string extension_of(std::string_view path) {
    const std::string name = name_of(path);
    const std::size_t dot = name.rfind('.');
    return dot == std::string::npos ? "" : name.substr(dot + 1);
}

bool is_source(std::string_view path) {
    const std::string extension = extension_of(path);
    return extension == "c" || extension == "cpp" || extension == "h" || extension == "comp" ||
           extension == "glsl";
}

std::string without_comments(std::string text) {
    for (std::size_t i = 0; i + 1 < text.size(); ++i) {
        if (text[i] != '/' || (text[i + 1] != '/' && text[i + 1] != '*')) continue;
        const bool block = text[i + 1] == '*';
        const std::size_t found = block ? text.find("*/", i + 2) : text.find('\n', i);
        const std::size_t end =
            found == std::string::npos ? text.size() : found + (block ? std::size_t{2} : 0);
        for (; i < end; ++i)
            if (text[i] != '\n') text[i] = ' ';
        --i;
    }
    return text;
}

std::string at(const TextFile& file, std::size_t line_index, std::string_view what) {
    return file.path + ":" + std::to_string(line_index + 1) + ": " + std::string(what);
}

void expect_none(const Findings& findings) {
    if (findings.empty()) return;
    std::string list;
    for (const std::string& finding : findings) list += "\n" + finding;
    ADD_FAILURE() << findings.size() << " findings:" << list;
}

void expect_found(const Findings& findings, std::size_t count, std::string_view part) {
    ASSERT_EQ(findings.size(), count) << ::testing::PrintToString(findings);
    if (count > 0) {
        EXPECT_NE(findings[0].find(part), std::string::npos)
            << "expected '" << part << "' in: " << findings[0];
    }
}

Output run(const std::string& command) {
    Output output;
    FILE* pipe = popen(command.c_str(), "r");
    if (pipe == nullptr) return output;
    std::array<char, 4096> buffer{};
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
        output.text.append(buffer.data(), count);
    const int status = pclose(pipe);
    output.status = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    return output;
}

}  // namespace splat::house
