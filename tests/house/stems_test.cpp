// Every row of the op table has its shaders, host file, reference and test, all of one stem.

#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

/// Names of the rows, from lines such as `{.name = "group_norm",`.
std::vector<std::string> op_names(const std::string& table) {
    static const std::regex pattern(
        R"re(^(?:const OpRow k\w+ = )?\s*\{?\s*\.name = "([a-z0-9_]+)".*)re");
    std::vector<std::string> names;
    std::smatch match;
    for (const std::string& line : lines_of(table))
        if (std::regex_match(line, match, pattern)) names.push_back(match[1]);
    return names;
}

Findings check_stems(const std::string& table, const std::vector<TextFile>& files) {
    std::set<std::string> paths;
    for (const TextFile& file : files) paths.insert(file.path);
    Findings findings;
    const std::vector<std::string> names = op_names(table);
    if (names.empty()) findings.push_back("src/ops: no row was found");
    for (const std::string& op : names) {
        // In the folder itself or in a group such as shaders/ops/losses.
        const auto expect = [&](const std::string& folder, const std::string& name) {
            for (const std::string& path : paths)
                if (starts_with(path, folder) && starts_with(name_of(path), name)) return;
            findings.push_back("op " + op + ": there is no " + folder + name);
        };
        expect("shaders/ops/", op + "_forward.comp");
        expect("shaders/ops/", op + "_backward");
        expect("src/ops/", op + ".h");
        expect("src/ops/", op + ".cpp");
        expect("tests/ref/", op + "_ref.h");
        expect("tests/ops/", op + "_test.cpp");
    }
    return findings;
}

/// Every row of `rows` begins a line as cmake/RowTable.cmake finds it.
Findings check_listed(const std::string& rows) {
    static const std::regex pattern("^const OpRow k[A-Za-z0-9]+Row .*");
    const std::vector<std::string> lines = lines_of(rows);
    const auto listed = static_cast<std::size_t>(
        std::count_if(lines.begin(), lines.end(),
                      [](const std::string& line) { return std::regex_match(line, pattern); }));
    if (listed == op_names(rows).size()) return {};
    return {"src/ops: " + std::to_string(listed) + " rows, but " +
            std::to_string(op_names(rows).size()) + " names of rows"};
}

const char* const kSampleStems =
    "const OpRow rows[] = {\n"
    "    {.name = \"foo\",\n"
    "     .inputs = {\"x\"}},\n"
    "    // {.name = \"bar\",\n";

std::vector<TextFile> sample_files() {
    return {{"shaders/ops/foo_backward_input.comp", ""},
            {"shaders/ops/foo_forward.comp", ""},
            {"src/ops/foo.cpp", ""},
            {"src/ops/foo.h", ""},
            {"tests/ops/foo_test.cpp", ""},
            {"tests/ref/foo_ref.h", ""}};
}

TEST(Stems, EveryOpIsInAllPlaces) {
    std::string rows;
    for (const TextFile& file : repository())
        if (starts_with(file.path, "src/ops/")) rows += file.text;
    expect_none(check_stems(rows, repository()));
}

TEST(Stems, EveryRowIsInTheTable) {
    std::string rows;
    for (const TextFile& file : repository())
        if (starts_with(file.path, "src/ops/")) rows += file.text;
    expect_none(check_listed(rows));
}

TEST(Stems, RuleFindsARowThatIsNotListed) {
    const std::string row = "const OpRow kFooRow = {.name = \"foo\",\n";
    expect_none(check_listed(row));
    expect_found(check_listed("extern " + row + "    .name = \"foo\",\n"), 1,
                 "0 rows, but 1 names");
    expect_found(check_listed("const OpRow kFooRow = {\n"), 1, "1 rows, but 0 names");
}

TEST(Stems, RuleAcceptsACompleteOp) {
    expect_none(check_stems(kSampleStems, sample_files()));
}

TEST(Stems, RuleAcceptsAnOpOfAGroup) {
    std::vector<TextFile> files = sample_files();
    files[2].path = "src/ops/group/foo.cpp";
    expect_none(check_stems(kSampleStems, files));
    files[2].path = "src/nn/foo.cpp";
    expect_found(check_stems(kSampleStems, files), 1, "op foo: there is no src/ops/foo.cpp");
}

TEST(Stems, RuleFindsEachMissingFile) {
    for (std::size_t i = 0; i < sample_files().size(); ++i) {
        std::vector<TextFile> files = sample_files();
        files.erase(files.begin() + static_cast<std::ptrdiff_t>(i));
        expect_found(check_stems(kSampleStems, files), 1, "op foo: there is no");
    }
}

TEST(Stems, RuleFindsAnUnreadableTable) {
    expect_found(check_stems("const OpRow rows[] = {};\n", sample_files()), 1, "no row");
}

}  // namespace
}  // namespace splat::house
