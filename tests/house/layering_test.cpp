// Which folder may include which: the table of src/README.md, read as data.

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

/// Headers of Vulkan and of libraries that only some layers may know.
const std::map<std::string, std::set<std::string>> kThirdParty = {
    {"volk.h", {"vk"}},       {"vulkan/", {"vk"}},
    {"nlohmann/", {"core"}},  {"glm/", {"scene", "model", "data", "raster", "api"}},
    {"png.h", {"io"}},        {"jpeglib.h", {"io"}},
    {"jerror.h", {"io"}},     {"webp/", {"io"}},
    {"gif_lib.h", {"io"}},    {"zstd.h", {"io"}},
    {"zlib.h", {"io", "vk"}}, {"yaml.h", {"core"}},
};

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
        if (include.system) continue;
        const std::string first = path.substr(0, path.find('/'));
        if (path.find("..") != std::string::npos)
            refuse("'..' in an include");
        else if (row->second.count(first) == 0 && row->second.count(path) == 0)
            refuse("layer " + layer + " may not include it, see the table of src/README.md");
    }
    return findings;
}

Findings check_tools_file(const TextFile& file) {
    Findings findings;
    static const std::set<std::string> layers = {"core",  "scene", "io",     "data",  "priors",
                                                 "vk",    "ops",   "raster", "nn",    "model",
                                                 "train", "eval",  "api",    "params"};
    for (const Include& include : includes_of(file)) {
        const std::string first = include.path.substr(0, include.path.find('/'));
        if (include.path.find("..") != std::string::npos)
            findings.push_back(at(file, include.line, "'..' in the include " + include.path));
        else if (layers.count(first) != 0 && include.path.find('/') != std::string::npos)
            findings.push_back(at(file, include.line,
                                  "includes " + include.path + ": tools use include/splat.h only"));
        else if (starts_with(include.path, "vulkan/") || include.path == "volk.h")
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
        if (starts_with(file.path, "tools/")) add(check_tools_file(file));
        if (starts_with(file.path, "bindings/")) add(check_tools_file(file));
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
    ASSERT_GE(table.size(), 5U) << "the table of src/README.md was not found";
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

TEST(Layering, RuleAcceptsWhatTheTableAllows) {
    expect_none(check_sample("src/vk/a.cpp",
                             "#include \"core/status.h\"\n#include \"vk/a.h\"\n#include <volk.h>\n"
                             "#include \"params/a_params.h\"\n#include <vector>\n"));
    expect_none(check_sample("src/eval/a.cpp", "#include \"vk/timers.h\"\n"));
    expect_none(
        check_sample("tools/vkrun/a.cpp",
                     "#include \"vkrun/cli/table.h\"\n#include <splat.h>\n#include \"ref/a_ref.h\"\n"));
}

TEST(Layering, RuleFindsForbiddenIncludes) {
    expect_found(check_sample("src/core/a.cpp", "\n#include \"vk/device.h\"\n"), 1, "a.cpp:2:");
    expect_found(check_sample("src/core/a.cpp", "# include <vulkan/vulkan.h>\n"), 1, "vulkan");
    expect_found(check_sample("src/vk/a.cpp", "#include \"../core/status.h\"\n"), 1, "'..'");
    expect_found(check_sample("src/eval/a.cpp", "#include \"vk/device.h\"\n"), 1, "layer eval");
    expect_found(check_sample("src/other/a.cpp", ""), 1, "'other' is not in");
    expect_found(check_sample("tools/vkrun/a.cpp", "#include \"core/status.h\"\n"), 1,
                 "splat.h only");
    expect_found(check_sample("tools/vkrun/a.cpp", "#include <volk.h>\n"), 1, "Vulkan");
}

}  // namespace
}  // namespace splat::house
