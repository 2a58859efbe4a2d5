#include "core/json.h"

#include <gtest/gtest.h>

#include <string>

namespace splat {
namespace {

std::string nested(int levels, const std::string& inside) {
    const auto count = static_cast<std::size_t>(levels);
    return std::string(count, '[') + inside + std::string(count, ']');
}

std::string nested_objects(int levels) {
    std::string text;
    for (int i = 0; i < levels; ++i) text += "{\"a\":";
    return text + "1" + std::string(static_cast<std::size_t>(levels), '}');
}

void expect_refused(const std::string& text, const std::string& because) {
    const auto json = parse_json(text, "config");
    ASSERT_FALSE(json.ok()) << text.substr(0, 80);
    EXPECT_EQ(json.status().code(), Code::kInvalidArgument);
    EXPECT_TRUE(json.status().message().starts_with("config: ")) << json.status().message();
    EXPECT_NE(json.status().message().find(because), std::string::npos) << json.status().message();
}

TEST(Json, KeepsTheOrderOfKeys) {
    const auto json = parse_json(R"({"b": 1, "a": [true, null, "x"], "c": 1.5})", "config");
    ASSERT_TRUE(json.ok()) << json.status().message();
    EXPECT_EQ(json.value().dump(), R"({"b":1,"a":[true,null,"x"],"c":1.5})");
}

TEST(Json, RefusesWhatIsNoJson) {
    for (const char* text : {"", "{", "[1,]", "{\"a\" 1}", "nul", "\"\xFF\"", "1 2", "NaN", "'a'"})
        expect_refused(text, "not valid JSON");
}

TEST(Json, LimitsDepthExactly) {
    EXPECT_TRUE(parse_json(nested(kMaxJsonDepth, ""), "config").ok());
    EXPECT_TRUE(parse_json(nested(kMaxJsonDepth, "1"), "config").ok());
    EXPECT_TRUE(parse_json(nested_objects(kMaxJsonDepth), "config").ok());
    expect_refused(nested(kMaxJsonDepth + 1, ""), "nests deeper than 64 levels");
    expect_refused(nested(kMaxJsonDepth + 1, "1"), "nests deeper than 64 levels");
    expect_refused(nested_objects(kMaxJsonDepth + 1), "nests deeper than 64 levels");
}

TEST(Json, SurvivesAMillionBrackets) {
    expect_refused(nested(1'000'000, ""), "nests deeper");
    EXPECT_FALSE(parse_json(std::string(1'000'000, '['), "config").ok());
    EXPECT_FALSE(parse_json(std::string(1'000'000, '{'), "config").ok());
}

TEST(Json, LimitsSize) {
    std::string text = "\"" + std::string(kMaxJsonBytes - 2, 'x') + "\"";
    EXPECT_TRUE(parse_json(text, "config").ok());
    text += " ";
    expect_refused(text, "bytes of JSON");
}

}  // namespace
}  // namespace splat
