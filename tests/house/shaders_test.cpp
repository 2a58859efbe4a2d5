// Rules for all files of shaders; shaders/README.md gives the reasons.

#include <gtest/gtest.h>

#include <regex>

#include "house/repo.h"

namespace splat::house {
namespace {

constexpr std::size_t kMaxHeadLines = 20;

std::size_t line_of(const std::string& text, std::size_t position) {
    std::size_t line = 0;
    for (std::size_t i = 0; i < position; ++i)
        if (text[i] == '\n') ++line;
    return line;
}

/// A buffer is readonly or writeonly, unless the line of its declaration says `// accumulates`.
Findings check_buffers(const TextFile& file) {
    static const std::regex declaration(
        R"(layout\s*\([^)]*\)([^;{()]*)\b(buffer|imageBuffer|uimageBuffer|iimageBuffer)\b)");
    Findings findings;
    const std::string code = without_comments(file.text);
    const std::vector<std::string> lines = lines_of(file.text);
    for (std::sregex_iterator it(code.begin(), code.end(), declaration), end; it != end; ++it) {
        const std::string qualifiers = (*it)[1];
        const std::size_t first = line_of(code, static_cast<std::size_t>(it->position(0)));
        const std::size_t last = line_of(code, static_cast<std::size_t>(it->position(2)));
        const bool one_way = qualifiers.find("readonly") != std::string::npos ||
                             qualifiers.find("writeonly") != std::string::npos;
        if (!one_way && lines[last].find("// accumulates") == std::string::npos)
            findings.push_back(at(file, first,
                                  "a buffer that is neither readonly nor writeonly, and not marked "
                                  "'// accumulates'"));
    }
    return findings;
}

Findings check_words(const TextFile& file) {
    struct Word {
        std::regex pattern;
        const char* why;
    };
    static const Word words[] = {
        {std::regex(R"(\bgl_NumWorkGroups\b)"), "gl_NumWorkGroups: the recorder splits dispatches"},
        {std::regex(R"(GL_EXT_shader_atomic_float)"), "float atomics: not reproducible"},
        {std::regex(R"(\batomicCompSwap\b)"), "atomicCompSwap: a float atomic in disguise"},
        {std::regex(R"(GL_EXT_buffer_reference)"), "buffer_reference: invisible to validation"},
        {std::regex(R"(\bshared\b.*\[.*\bgl_WorkGroupSize\b)"),
         "a shared array of gl_WorkGroupSize: Metal refuses it, take kWorkgroupSize"},
    };
    Findings findings;
    const std::vector<std::string> lines = lines_of(without_comments(file.text));
    for (std::size_t i = 0; i < lines.size(); ++i)
        for (const Word& word : words)
            if (std::regex_search(lines[i], word.pattern))
                findings.push_back(at(file, i, word.why));
    return findings;
}

/// Ids of specialisation constants have names: that of k<Name> ends in <Name>Id.
Findings check_spec_ids(const TextFile& file) {
    static const std::regex size(R"(local_size_[xyz]_id\s*=\s*(\w+))");
    static const std::regex constant(
        R"(constant_id\s*=\s*([^\s,)]+)[^)]*\)\s*const\s+\w+\s+k?(\w+))");
    Findings findings;
    const std::vector<std::string> lines = lines_of(without_comments(file.text));
    for (std::size_t i = 0; i < lines.size(); ++i) {
        std::smatch match;
        if (std::regex_search(lines[i], match, size) && match[1] != "kWorkgroupSizeId")
            findings.push_back(at(file, i, "the id of the workgroup size is kWorkgroupSizeId"));
        if (lines[i].find("constant_id") == std::string::npos) continue;
        const bool matches = std::regex_search(lines[i], match, constant);
        const std::string id = matches ? match[1].str() : "";
        if (!matches || !starts_with(id, "k") || !ends_with(id, match[2].str() + "Id"))
            findings.push_back(at(file, i,
                                  "the constant_id of k<Name> is a k<Family><Name>Id of "
                                  "shaders/include/params/"));
    }
    return findings;
}

/// Host code names them, too: no entry of a list `constants` starts with a number.
Findings check_host_ids(const TextFile& file) {
    static const std::regex start(
        R"(\bconstants\s*(=\s*\{|\.push_back\(|\.emplace_back\(\s*(\d)?))");
    static const std::regex number(R"(\s*\d[^]*)");
    Findings findings;
    if (!starts_with(file.path, "src/") || !is_source(file.path)) return findings;
    const std::string code = without_comments(file.text);
    for (std::sregex_iterator it(code.begin(), code.end(), start), end; it != end; ++it) {
        std::size_t i = static_cast<std::size_t>(it->position(0) + it->length(0));
        bool bare = (*it)[2].matched;
        for (int depth = 1; depth > 0 && !bare && i < code.size(); ++i) {
            if (code[i] == '}' || code[i] == ')') --depth;
            if (code[i] != '{' && code[i] != '(') continue;
            ++depth;
            bare = code[i] == '{' && std::regex_match(code.substr(i + 1, 8), number);
        }
        if (bare)
            findings.push_back(at(file, line_of(code, i - 1),
                                  "the id of a specialisation constant is a number; name it in "
                                  "shaders/include/params/"));
    }
    return findings;
}

/// A comment comes first, after #version, #ifndef and blank lines.
Findings check_head(const TextFile& file) {
    std::size_t head = 0;
    bool block = false;
    for (const std::string& line : lines_of(file.text)) {
        if (head == 0 && (line.empty() || line[0] == '#')) continue;
        block = block || starts_with(line, "/*");
        if (!block && !starts_with(line, "//")) break;
        if (block && line.find("*/") != std::string::npos) block = false;
        ++head;
    }
    if (head == 0) return {file.path + ": no comment at the head"};
    if (head > kMaxHeadLines)
        return {file.path + ": " + std::to_string(head) + " lines of head comment, limit " +
                std::to_string(kMaxHeadLines)};
    return {};
}

Findings check_shaders(const std::vector<TextFile>& files) {
    Findings findings;
    for (const TextFile& file : files) {
        const std::string extension = extension_of(file.path);
        if (!starts_with(file.path, "shaders/") || (extension != "comp" && extension != "glsl"))
            continue;
        for (const auto& rule : {check_buffers, check_words, check_spec_ids, check_head})
            for (const std::string& finding : rule(file)) findings.push_back(finding);
    }
    return findings;
}

Findings check_shader(const std::string& body) {
    return check_shaders({{"shaders/ops/a.comp", "#version 460\n// y = x\n" + body}});
}

TEST(Shaders, RepositoryFollowsTheRules) {
    expect_none(check_shaders(repository()));
}

TEST(Shaders, HostCodeNamesIds) {
    Findings findings;
    for (const TextFile& file : repository())
        for (const std::string& finding : check_host_ids(file)) findings.push_back(finding);
    expect_none(findings);
}

TEST(Shaders, RuleFindsNumbersAsIds) {
    const auto check = [](const std::string& text) {
        return check_host_ids({"src/ops/a.cpp", text});
    };
    expect_none(
        check(".constants = {{params::kAId, 1},\n {params::kBId, f(2)}},\n.groups = {1, 2}"));
    expect_none(check("constants.push_back({params::kAId, 6});\nx = {{1, 2}};"));
    expect_none(check(".constants = pass.constants, .groups = {{1, 1}}"));
    expect_found(check(".constants = {{params::kAId, 1},\n              {12, 2}},"), 1, "a.cpp:2:");
    expect_found(check("vector<C> constants = {{ 0, size}};"), 1, "a.cpp:1:");
    expect_found(check("constants.push_back({11, 1});"), 1, "a number");
    expect_found(check("constants.emplace_back(11, 1);"), 1, "a number");
}

TEST(Shaders, RepositoryHasShaders) {
    std::size_t count = 0;
    for (const TextFile& file : repository())
        if (ends_with(file.path, ".comp")) ++count;
    EXPECT_GT(count, 0U);
}

TEST(Shaders, RuleAcceptsDeclaredAccess) {
    expect_none(
        check_shader("layout(binding = 0) readonly buffer X { float x[]; };\n"
                     "layout(binding = 1) writeonly restrict buffer Y { float y[]; };\n"
                     "layout(binding = 2) buffer Z { float z[]; };  // accumulates\n"
                     "layout(binding = 3) uniform samplerBuffer t;\n"
                     "// gl_NumWorkGroups is not used\n"));
}

TEST(Shaders, RuleFindsUndeclaredAccess) {
    expect_found(check_shader("layout(binding = 0) buffer X { float x[]; };\n"), 1, "a.comp:3:");
    expect_found(check_shader("layout(set = 0,\n       binding = 0) buffer X {\n float x[]; };\n"),
                 1, "neither readonly nor writeonly");
    expect_found(check_shader("layout(binding = 0) /* readonly */ buffer X { float x[]; };\n"), 1,
                 "neither");
    expect_found(check_shader("#define B(n) layout(binding = n) buffer B##n { vec4 b[]; }\n"), 1,
                 "neither");
    expect_found(check_shader("layout(binding = 0, rgba32f) uniform imageBuffer i;\n"), 1,
                 "neither");
}

TEST(Shaders, RuleFindsForbiddenWords) {
    expect_found(check_shader("uint n = gl_NumWorkGroups.x;\n"), 1, "gl_NumWorkGroups");
    expect_found(check_shader("#extension GL_EXT_shader_atomic_float : require\n"), 1,
                 "float atomics");
    expect_found(check_shader("atomicCompSwap(a, b, c);\n"), 1, "disguise");
    expect_found(check_shader("#extension GL_EXT_buffer_reference : require\n"), 1,
                 "buffer_reference");
    expect_found(check_shader("shared vec4 sums[2 * gl_WorkGroupSize.x];\n"), 1, "kWorkgroupSize");
    expect_none(check_shader("shared vec4 sums[kWorkgroupSize];\n"));
}

TEST(Shaders, RuleAcceptsNamedIds) {
    expect_none(
        check_shader("layout(local_size_x_id = kWorkgroupSizeId) in;\n"
                     "layout(constant_id = kBlendExtraId) const bool kExtra = false;\n"
                     "layout(constant_id = kPackedStoresId) const uint kPackedStores = 1;\n"
                     "// constant_id = 10\n"));
}

TEST(Shaders, RuleFindsBareIds) {
    expect_found(check_shader("layout(constant_id = 10) const bool kExtra = false;\n"), 1,
                 "a.comp:3:");
    expect_found(check_shader("layout(local_size_x_id = 0) in;\n"), 1, "kWorkgroupSizeId");
    expect_found(check_shader("layout(constant_id = kBlendExtraId) const bool kDepth = false;\n"),
                 1, "k<Family><Name>Id");
    expect_found(check_shader("#define ID(n) layout(constant_id = n)\n"), 1, "constant_id");
}

TEST(Shaders, RuleFindsBadHeads) {
    expect_found(check_shaders({{"shaders/ops/a.comp", "#version 460\nvoid main() {}\n"}}), 1,
                 "no comment");
    std::string head = "#version 460\n";
    for (int i = 0; i < 20; ++i) head += "// line\n";
    expect_none(check_shaders({{"shaders/ops/a.comp", head}}));
    expect_found(check_shaders({{"shaders/ops/a.comp", head + "// line\n"}}), 1, "21 lines");
}

}  // namespace
}  // namespace splat::house
