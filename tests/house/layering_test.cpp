// Includes between folders follow the table of src/README.md, which this test reads.

#include <gtest/gtest.h>

#include <map>
#include <regex>
#include <set>

#include "house/repo.h"

namespace splat::house {
namespace {

/// Layer -> what it may include: names of layers, "params", "splat.h", or single headers as
/// "vk/timers.h".
using Table = std::map<std::string, std::set<std::string>>;

/// Headers of Vulkan and of libraries that only some layers may include.
const std::map<std::string, std::set<std::string>> kThirdParty = {
    {"volk.h", {"vk"}},    {"vulkan/", {"vk"}},  {"nlohmann/", {"core"}},  {"png.h", {"io"}},
    {"jpeglib.h", {"io"}}, {"jerror.h", {"io"}}, {"webp/", {"io"}},        {"gif_lib.h", {"io"}},
    {"zstd.h", {"io"}},    {"yaml.h", {"core"}}, {"zlib.h", {"io", "vk"}}, {"glm/", {"scene"}},
};

/// Headers of one system, which only src/core/os/ includes: beginnings of their names.
constexpr const char* kOfOneSystem[] = {
    "unistd.h", "fcntl.h",   "dlfcn.h",  "sys/",      "signal.h",  "csignal",
    "spawn.h",  "pthread.h", "dirent.h", "fnmatch.h", "poll.h",    "termios.h",
    "glob.h",   "pwd.h",     "link.h",   "xlocale.h", "windows.h", "io.h",
    "direct.h", "process.h", "winsock",  "shlobj"};

bool is_of_one_system(const std::string& header) {
    for (const char* const prefix : kOfOneSystem)
        if (starts_with(header, prefix)) return true;
    return false;
}

std::string trim(std::string text) {
    const char* blanks = " `\t";
    text.erase(0, text.find_first_not_of(blanks));
    text.erase(text.find_last_not_of(blanks) + 1);
    return text;
}

std::vector<std::string> split(const std::string& text, char separator) {
    std::vector<std::string> parts;
    std::string part;
    for (const char c : text + separator) {
        if (c == separator) {
            parts.push_back(trim(part));
            part.clear();
        } else {
            part += c;
        }
    }
    return parts;
}

/// Rows "| layer | may include | ... |" below the header row that starts with "| layer |".
Table parse_table(const std::string& markdown) {
    Table table;
    bool inside = false;
    for (const std::string& line : lines_of(markdown)) {
        const std::vector<std::string> cells = split(line, '|');
        if (cells.size() < 4) {
            inside = false;
        } else if (cells[1] == "layer") {
            inside = true;
        } else if (inside && cells[1].find("---") == std::string::npos) {
            for (const std::string& layer : split(cells[1], ',')) {
                table[layer].insert(layer);
                for (const std::string& used : split(cells[2], ','))
                    if (!used.empty()) table[layer].insert(used);
            }
        }
    }
    return table;
}

struct Include {
    std::string path;
    bool system = false;
    std::size_t line = 0;
};

std::vector<Include> includes_of(const TextFile& file) {
    static const std::regex pattern(R"re(^\s*#\s*include\s*([<"])([^>"]+)[>"].*)re");
    std::vector<Include> includes;
    const std::vector<std::string> lines = lines_of(file.text);
    std::smatch match;
    for (std::size_t i = 0; i < lines.size(); ++i)
        if (std::regex_match(lines[i], match, pattern))
            includes.push_back({match[2], match[1] == "<", i});
    return includes;
}

Findings check_src_file(const TextFile& file, const Table& table) {
    const std::string layer = split(file.path, '/')[1];
    const auto row = table.find(layer);
    if (row == table.end()) return {file.path + ": layer '" + layer + "' is not in src/README.md"};
    Findings findings;
    for (const Include& include : includes_of(file)) {
        const std::string& path = include.path;
        const auto refuse = [&](const std::string& why) {
            findings.push_back(at(file, include.line, "includes " + path + ": " + why));
        };
        for (const auto& [prefix, layers] : kThirdParty)
            if (starts_with(path, prefix) && layers.count(layer) == 0)
                refuse("not for layer " + layer);
        if (include.system && is_of_one_system(path) && !starts_with(file.path, "src/core/os/"))
            refuse("only src/core/os/ talks to the system");
        if (include.system) continue;
        const std::string first = path.substr(0, path.find('/'));
        if (path.find("..") != std::string::npos)
            refuse("'..' in an include");
        else if (row->second.count(first) == 0 && row->second.count(path) == 0)
            refuse("layer " + layer + " may not include it, see the table of src/README.md");
    }
    return findings;
}

Findings check_tools_file(const TextFile& file, const Table& table) {
    Findings findings;
    for (const Include& include : includes_of(file)) {
        const std::string first = include.path.substr(0, include.path.find('/'));
        if (starts_with(file.path, "tools/") && include.system && is_of_one_system(include.path))
            findings.push_back(at(file, include.line,
                                  "includes " + include.path + ": core/os/ talks to the system"));
        if (include.path.find("..") != std::string::npos)
            findings.push_back(at(file, include.line, "'..' in the include " + include.path));
        else if (starts_with(file.path, "tools/") && starts_with(include.path, "core/os/"))
            continue;
        else if ((table.count(first) != 0 || first == "params") &&
                 include.path.find('/') != std::string::npos)
            findings.push_back(
                at(file, include.line,
                   "includes " + include.path + ": tools use include/splat.h and core/os/ only"));
        else if ((starts_with(include.path, "vulkan/") || include.path == "volk.h") &&
                 !starts_with(file.path, "tools/bench/dispatch/") &&
                 file.path != "bindings/c/engine.c")
            findings.push_back(at(file, include.line, "tools do not talk to Vulkan"));
    }
    return findings;
}

Findings check_layering(const std::vector<TextFile>& files, const Table& table) {
    Findings findings;
    const auto add = [&](const Findings& more) {
        findings.insert(findings.end(), more.begin(), more.end());
    };
    for (const TextFile& file : files) {
        if (!is_source(file.path)) continue;
        if (starts_with(file.path, "src/")) add(check_src_file(file, table));
        if (starts_with(file.path, "tools/")) add(check_tools_file(file, table));
        if (starts_with(file.path, "bindings/")) add(check_tools_file(file, table));
    }
    return findings;
}

/// Layer -> the layers that its target uses, from calls of splat_layer. A target with a FOLDER is a part of that
/// folder's layer, without a row.
Table parse_targets(const std::string& cmake) {
    static const std::regex call(R"re(splat_layer\(\s*(\w+)([^)]*)\))re");
    static const std::regex word(R"re(\w[\w./]*)re");
    Table table;
    std::set<std::string> parts;
    for (std::sregex_iterator it(cmake.begin(), cmake.end(), call), end; it != end; ++it) {
        const std::string arguments = (*it)[2];
        if (arguments.find("FOLDER") != std::string::npos) {
            parts.insert((*it)[1]);
            continue;
        }
        std::set<std::string>& uses = table[(*it)[1]];
        const std::size_t start = arguments.find("USES");
        if (start == std::string::npos) continue;
        const std::string names = arguments.substr(start + 4);
        for (std::sregex_iterator name(names.begin(), names.end(), word); name != end; ++name)
            uses.insert(name->str());
    }
    for (auto& [layer, uses] : table)
        for (const std::string& part : parts) uses.erase(part);
    return table;
}

/// A layer has files, and each entry of its row is a layer or a header that one of them includes.
Findings check_unused(const std::vector<TextFile>& files, const Table& table,
                      const std::string& where) {
    Table included;
    for (const TextFile& file : files) {
        if (!starts_with(file.path, "src/") || !is_source(file.path)) continue;
        std::set<std::string>& found = included[split(file.path, '/')[1]];
        for (const Include& include : includes_of(file)) {
            found.insert(include.path);
            found.insert(include.path.substr(0, include.path.find('/')));
        }
    }
    Findings findings;
    for (const auto& [layer, allowed] : table) {
        if (included.count(layer) == 0) {
            findings.push_back(where + ": there is no file of layer " + layer);
            continue;
        }
        for (const std::string& entry : allowed)
            if (entry != layer && included[layer].count(entry) == 0)
                findings.push_back(where + ": layer " + layer + " includes nothing of " + entry);
    }
    return findings;
}

/// The README of a layer names, behind "May include:", the layers of its row. Other words there, such as
/// single headers, are not looked at; a README without that list is accepted.
Findings check_readme(const TextFile& readme, const Table& table) {
    const std::string layer = name_of(folder_of(readme.path));
    const std::string start = "May include:";
    const std::size_t at = readme.text.find(start);
    if (at == std::string::npos) return {};
    std::string list = readme.text.substr(at + start.size());
    for (char& c : list)
        if (c == '\n') c = ' ';
    std::set<std::string> named;
    for (const std::string& word : split(list.substr(0, list.find(". ")), ','))
        if (table.count(word) != 0) named.insert(word);
    Findings findings;
    for (const auto& [other, row] : table) {
        const bool allowed = other != layer && table.at(layer).count(other) != 0;
        if (allowed != (named.count(other) != 0))
            findings.push_back(readme.path + (allowed ? ": does not name " : ": names ") + other +
                               ", unlike the table of src/README.md");
    }
    return findings;
}

const char* const kSampleTable =
    "| layer | may include | must not |\n"
    "|---|---|---|\n"
    "| core | | |\n"
    "| vk | core, `params` | |\n"
    "| train, eval | `vk/timers.h`, core | |\n";

Findings check_sample(const std::string& path, const std::string& text) {
    return check_layering({{path, text}}, parse_table(kSampleTable));
}

TEST(Layering, RepositoryFollowsTheTable) {
    const Table table = parse_table(repository_file("src/README.md").text);
    ASSERT_GE(table.size(), 5U) << "found no table in src/README.md";
    EXPECT_EQ(table.at("core").size(), 1U) << "core depends on nothing";
    expect_none(check_layering(repository(), table));
}

TEST(Layering, EveryFolderOfSrcIsInTheTable) {
    const Table table = parse_table(repository_file("src/README.md").text);
    for (const TextFile& file : repository()) {
        if (!starts_with(file.path, "src/") || !is_source(file.path)) continue;
        EXPECT_EQ(table.count(split(file.path, '/')[1]), 1U) << file.path;
    }
}

TEST(Layering, TableAndTargetsNameWhatIsUsed) {
    const Table table = parse_table(repository_file("src/README.md").text);
    const Table targets = parse_targets(repository_file("src/CMakeLists.txt").text);
    EXPECT_EQ(targets.size(), table.size());
    expect_none(check_unused(repository(), table, "src/README.md"));
    expect_none(check_unused(repository(), targets, "src/CMakeLists.txt"));
}

TEST(Layering, ReadmesOfLayersFollowTheTable) {
    const Table table = parse_table(repository_file("src/README.md").text);
    for (const auto& [layer, row] : table)
        expect_none(check_readme(repository_file("src/" + layer + "/README.md"), table));
}

TEST(Layering, RuleFindsOtherReadmes) {
    const Table table = parse_table(kSampleTable);
    const auto check = [&](const std::string& layer, const std::string& text) {
        return check_readme({"src/" + layer + "/README.md", text}, table);
    };
    expect_none(check("vk", "# vk\n\nMay include: core, volk,\n`params`. Not train.\n"));
    expect_none(check("vk", "# vk\n\nMay include all.\n"));
    expect_found(check("vk", "May include: volk.\n"), 1, "src/vk/README.md: does not name core");
    expect_found(check("eval", "May include: `vk/timers.h`, core, train.\n"), 1, "names train");
}

TEST(Layering, RuleFindsUnusedEntries) {
    const std::vector<TextFile> files = {
        {"src/core/a.cpp", ""},
        {"src/vk/a.h", "#include \"core/a.h\"\n#include \"params/a.h\"\n"},
        {"src/eval/a.h", "#include \"core/a.h\"\n#include \"vk/timers.h\"\n"},
        {"src/train/a.h", "#include \"core/a.h\"\n#include \"vk/timers.h\"\n"}};
    const Table table = parse_table(kSampleTable);
    expect_none(check_unused(files, table, "table"));
    expect_found(check_unused({files.begin(), files.end() - 1}, table, "table"), 1,
                 "table: there is no file of layer train");
    std::vector<TextFile> fewer = files;
    fewer[3].text = "#include \"core/a.h\"\n#include \"vk/device.h\"\n";
    expect_found(check_unused(fewer, table, "table"), 1, "train includes nothing of vk/timers.h");
    const Table targets = parse_targets(
        "splat_layer(os FOLDER core/os SOURCES a.cpp)\n"
        "splat_layer(core SOURCES a.cpp USES os)\nsplat_layer(\n  vk\n  SOURCES a.cpp\n  USES core "
        "params)\n"
        "splat_layer(eval SOURCES a.cpp USES vk core)");
    expect_none(check_unused(files, targets, "targets"));
    fewer[1].text = "#include \"core/a.h\"\n";
    expect_found(check_unused(fewer, targets, "targets"), 1, "layer vk includes nothing of params");
}

TEST(Layering, RuleAcceptsWhatTheTableAllows) {
    expect_none(check_sample("src/vk/a.cpp",
                             "#include \"core/status.h\"\n#include \"vk/a.h\"\n#include <volk.h>\n"
                             "#include \"params/a_params.h\"\n#include <vector>\n"));
    expect_none(check_sample("src/eval/a.cpp", "#include \"vk/timers.h\"\n"));
    expect_none(check_sample("src/core/os/a.cpp", "#include <sys/stat.h>\n"));
    expect_none(check_sample(
        "tools/vkrun/a.cpp",
        "#include \"vkrun/cli/table.h\"\n#include <splat.h>\n#include \"ref/a_ref.h\"\n"
        "#include \"core/os/file.h\"\n"));
}

TEST(Layering, RuleFindsForbiddenIncludes) {
    expect_found(check_sample("src/core/a.cpp", "\n#include \"vk/device.h\"\n"), 1, "a.cpp:2:");
    expect_found(check_sample("src/core/a.cpp", "# include <vulkan/vulkan.h>\n"), 1, "vulkan");
    expect_found(check_sample("src/vk/a.cpp", "#include \"../core/status.h\"\n"), 1, "'..'");
    expect_found(check_sample("src/eval/a.cpp", "#include \"vk/device.h\"\n"), 1, "layer eval");
    expect_found(check_sample("src/other/a.cpp", ""), 1, "'other' is not in");
    expect_found(check_sample("src/vk/a.cpp", "#include <unistd.h>\n#include <sys/stat.h>\n"), 2,
                 "only src/core/os/");
    expect_found(check_sample("tools/vkrun/a.cpp", "#include \"core/status.h\"\n"), 1,
                 "splat.h and core/os/ only");
    expect_found(check_sample("tools/vkrun/a.cpp", "#include <unistd.h>\n"), 1,
                 "core/os/ talks to the system");
    expect_found(check_sample("bindings/a.cpp", "#include \"core/os/file.h\"\n"), 1, "splat.h");
    expect_found(check_sample("tools/vkrun/a.cpp", "#include <volk.h>\n"), 1, "Vulkan");
}

}  // namespace
}  // namespace splat::house
