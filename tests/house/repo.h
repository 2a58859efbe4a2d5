#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace splat::house {

/// A file of the repository; a binary one has an empty text. Tests of the rules make their own in
/// memory.
struct TextFile {
    std::string path;  ///< from the root, with '/'
    std::string text;
};

/// What a rule found, one sentence each: "path:line: what is wrong".
using Findings = std::vector<std::string>;

/// All files of the source tree, without those of builds and of version control. Read once.
const std::vector<TextFile>& repository();

/// The file of that path; if it does not exist, the test fails and the text is empty.
const TextFile& repository_file(const std::string& path);

std::vector<std::string> lines_of(std::string_view text);
bool starts_with(std::string_view text, std::string_view prefix);
bool ends_with(std::string_view text, std::string_view suffix);

/// Folder part of a path without the last '/', "" for the root.
std::string folder_of(std::string_view path);
std::string name_of(std::string_view path);

/// Name without the last extension.
std::string stem_of(std::string_view path);

/// Text after the last '.' of the name, "" without a '.'.
std::string extension_of(std::string_view path);

/// C, C++ or GLSL.
bool is_source(std::string_view path);

/// C, C++ or GLSL with blanks in place of its comments; the rest keeps its place and line.
std::string without_comments(std::string text);

/// "path:line: what".
std::string at(const TextFile& file, std::size_t line_index, std::string_view what);

/// Fails the current test if there are findings, and lists them.
void expect_none(const Findings& findings);

/// Fails the current test unless there are `count` findings and the first one contains `part`.
void expect_found(const Findings& findings, std::size_t count, std::string_view part);

/// Standard output and exit status of a command.
struct Output {
    std::string text;
    int status = -1;
};
Output run(const std::string& command);

}  // namespace splat::house
