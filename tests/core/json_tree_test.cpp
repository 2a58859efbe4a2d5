#include "core/json_tree.h"

#include <gtest/gtest.h>

#include "core/json.h"
#include "support/expect_status.h"

namespace splat {
namespace {

std::string nested(int levels, char open, const std::string& inside, char close) {
    const auto count = static_cast<std::size_t>(levels);
    return std::string(count, open) + inside + std::string(count, close);
}

void expect_tree_refused(const std::string& text, const std::string& because) {
    const auto json = parse_json_tree(text, "config");
    ASSERT_FALSE(json.ok()) << text.substr(0, 80);
    EXPECT_EQ(json.status().code(), Code::kInvalidArgument);
    EXPECT_TRUE(json.status().message().starts_with("config: ")) << json.status().message();
    EXPECT_HAS(json.status().message(), because);
}

TEST(JsonTree, HoldsWhatTheTextSays) {
    const JsonTree root = need(parse_json_tree(
        R"({"a": [1, -2.5, 18446744073709551615, true, null, "x\u00e9", []], "b": 7, "d": {"a": {"b": 1}}})",
        "config"));
    ASSERT_TRUE(root.is_object());
    ASSERT_NE(root.find("a"), nullptr);
    const JsonTree::List* const list = root.find("a")->list();
    ASSERT_NE(list, nullptr);
    ASSERT_EQ(list->size(), 7U);
    EXPECT_EQ((*list)[0].number(), 1.0);
    EXPECT_EQ((*list)[1].number(), -2.5);
    EXPECT_EQ((*list)[2].number(), 18446744073709551616.0);
    EXPECT_EQ((*list)[3].number(), std::nullopt);
    EXPECT_EQ(std::get<bool>((*list)[3].value), true);
    EXPECT_TRUE((*list)[4].is_null());
    ASSERT_NE((*list)[5].text(), nullptr);
    EXPECT_EQ(*(*list)[5].text(), "x\u00e9");
    EXPECT_TRUE((*list)[6].list()->empty());
    EXPECT_EQ(root.find("b")->number(), 7.0);
    EXPECT_EQ(root.find("d")->find("a")->find("b")->number(), 1.0);
    EXPECT_EQ(root.find("c"), nullptr);
    EXPECT_EQ((*list)[0].find("a"), nullptr) << "a number has no members";
}

TEST(JsonTree, RefusesInvalidJson) {
    for (const char* text : {"", "{", "[1,]", "{\"a\":}", "nul", "[1] 2", "\"\xff\"", "[1e999]"})
        expect_tree_refused(text, "not valid JSON");
    expect_tree_refused(std::string("[1]") + '\0' + "[2]", "a NUL at byte 3 of 7");
}

TEST(JsonTree, RefusesNamesThatAppearTwice) {
    for (const char* text :
         {R"({"b": 1, "a": 2, "b": 3})", R"([{}, {"c": {"b": 1, "b": 1}}])", R"({"b":[],"b":[]})",
          R"({"c": {"a": 1}, "b": 2, "\u0062": {}, "a": 3})"})
        expect_tree_refused(text, "'b' appears twice in an object");
    EXPECT_TRUE(parse_json_tree(R"([{"a": {"a": 1}}, {"a": 2}])", "config").ok());
    std::string many = "{";
    for (int i = 0; i < 300'000; ++i) many += "\"" + std::to_string(i) + "\":0,";
    EXPECT_TRUE(parse_json_tree(many + "\"x\":0}", "config").ok());
    expect_tree_refused(many + "\"7\":0}", "'7' appears twice");
}

TEST(JsonTree, LimitsDepthAndSizeExactly) {
    EXPECT_TRUE(parse_json_tree(nested(kMaxJsonDepth, '[', "1", ']'), "config").ok());
    expect_tree_refused(nested(kMaxJsonDepth + 1, '[', "1", ']'), "nests deeper than 64 levels");
    expect_tree_refused(nested(1'000'000, '[', "", ']'), "nests deeper");
    std::string text = "\"" + std::string(kMaxJsonBytes - 2, 'x') + "\"";
    EXPECT_TRUE(parse_json_tree(text, "config").ok());
    text += " ";
    expect_tree_refused(text, "bytes of JSON");
}

TEST(JsonTree, CountsAreWholeNumbersThatDoublesHold) {
    const auto json = need(parse_json_tree(
        "[0, 7.0, 9007199254740992, 9007199254740994, -1, 0.5, 1e300, true, \"1\"]", "config"));
    const JsonTree::List& list = *json.list();
    EXPECT_EQ(list[0].count(), 0U);
    EXPECT_EQ(list[1].count(), 7U);
    EXPECT_EQ(list[2].count(), std::uint64_t{1} << 53U);
    for (std::size_t i = 3; i < list.size(); ++i) EXPECT_EQ(list[i].count(), std::nullopt) << i;
}

}  // namespace
}  // namespace splat
