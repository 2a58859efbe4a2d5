// The library writes JSON with core/json_writer.h. Hand-built text forgets to escape, and formats
// numbers differently from file to file.

#include <gtest/gtest.h>

#include "house/repo.h"

namespace splat::house {
namespace {

/// The writer itself, and the readers next to it.
bool is_exempt(const std::string& path) {
    return starts_with(path, "src/core/json");
}

Findings check_json(const std::vector<TextFile>& files) {
    struct Sign {
        const char* text;
        const char* what;
    };
    constexpr Sign kSigns[] = {
        {"\\\":", "a key of JSON in a string: use JsonWriter"},
        {"{\\\"", "an object of JSON in a string: use JsonWriter"},
        {"{\"", "an object of JSON in a raw string: use JsonWriter"},
        {"json_quote", "json_quote: JsonWriter::value() quotes texts"},
    };
    Findings findings;
    for (const TextFile& file : files) {
        if (!starts_with(file.path, "src/") || !is_source(file.path) || is_exempt(file.path))
            continue;
        const std::vector<std::string> lines = lines_of(without_comments(file.text));
        for (std::size_t i = 0; i < lines.size(); ++i)
            for (const Sign& sign : kSigns) {
                // A brace before a plain quote starts an initialiser, except in a raw string.
                const bool raw = lines[i].find("R\"") != std::string::npos;
                if (sign.text == std::string_view("{\"") && !raw) continue;
                if (lines[i].find(sign.text) == std::string::npos) continue;
                findings.push_back(at(file, i, sign.what));
                break;
            }
    }
    return findings;
}

Findings check_line(const std::string& line) {
    return check_json({{"src/api/a.cpp", line + "\n"}});
}

TEST(Json, RepositoryFollowsTheRule) {
    expect_none(check_json(repository()));
}

TEST(Json, RuleAcceptsTheWriterAndMessages) {
    expect_none(check_line(R"(json.begin_object().member("name", name).end();)"));
    expect_none(check_line(R"(return error(Code::kInvalidArgument, "'%s': no key", key);)"));
    expect_none(check_line(R"(const Row rows[] = {{"name", 1}, {"other", 2}};)"));
    expect_none(check_line(R"(/// {"names": [...]}, as \"{\"names\": []}\")"));
    expect_none(check_json({{"src/core/json.cpp", R"(text += "\":" + json_quote(x);)"},
                            {"tests/api/a.cpp", R"(const char* text = "{\"a\": 1}";)"}}));
}

TEST(Json, RuleFindsHandBuiltText) {
    expect_found(check_line(R"(text += ", \"count\": " + number;)"), 1, "a.cpp:1: a key");
    expect_found(check_line(R"(text = format("{\"%s\" : 1}", name);)"), 1, "an object");
    expect_found(check_line("text = R\"({\"a\" : 1})\";"), 1, "raw string");
    expect_found(check_line(R"(text += json_quote(name) + ": " + value;)"), 1, "json_quote");
    expect_found(check_line("// fine\n\ntext = \"{\\\"a\\\": 1}\";"), 1, "a.cpp:3:");
}

}  // namespace
}  // namespace splat::house
