#include "core/json.h"

#include <gtest/gtest.h>

#include <string>

#include "core/json_tree.h"
#include "support/expect_status.h"
#include "support/parsed_json.h"

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
    EXPECT_HAS(json.status().message(), because);
}

TEST(Json, KeepsTheOrderOfKeys) {
    const auto json = need(parse_json(R"({"b": 1, "a": [true, null, "x"], "c": 1.5})", "config"));
    EXPECT_EQ(json.dump(), R"({"b":1,"a":[true,null,"x"],"c":1.5})");
}

TEST(Json, RefusesInvalidJson) {
    for (const char* text : {"", "{", "[1,]", "{\"a\" 1}", "nul", "\"\xFF\"", "1 2", "NaN", "'a'"})
        expect_refused(text, "not valid JSON");
}

/// The parser takes a NUL for the end of the text.
TEST(Json, RefusesTextAfterANul) {
    const std::string text = std::string("{\"a\": 1}") + '\0';
    for (const std::string& given : {text, text + "{\"a\": 2}", text + " more"}) {
        expect_refused(given, "a NUL at byte 8");
        EXPECT_ERROR(parse_flat_json(given, "x"), Code::kInvalidArgument, "x: a NUL at byte 8");
        EXPECT_ERROR(visit_json(given, "x", [](const JsonEvent&) { return Status(); }),
                     Code::kInvalidArgument, "x: a NUL at byte 8");
    }
}

/// In a C string the text would end there.
TEST(Json, RefusesEscapedNuls) {
    for (const char* text :
         {R"({"a": "b\u0000c"})", R"({"a\u0000b": 1})", R"({"a": "\\\u0000"})"}) {
        expect_refused(text, "an escaped NUL (\\u0000) at byte ");
        EXPECT_ERROR(parse_flat_json(text, "x"), Code::kInvalidArgument, "escaped NUL");
        EXPECT_ERROR(visit_json(text, "x", [](const JsonEvent&) { return Status(); }),
                     Code::kInvalidArgument, "x: an escaped NUL");
        EXPECT_ERROR(parse_json_tree(text, "x"), Code::kInvalidArgument, "escaped NUL");
    }
    expect_refused(R"(["\\u0000", "\u0000"])", "at byte 13 of 21");
    for (const char* text : {R"(["\\u0000"])", R"(["\\\\u0000", "u0000"])"})  // backslashes
        EXPECT_OK(parse_json(text, "x"));
}

TEST(Json, MessagesQuoteTheStartOfLongTexts) {
    const std::string name(3'000'000, 'k');
    const auto expect_short = [](const Status& status) {
        EXPECT_FALSE(status.ok());
        EXPECT_LT(status.message().size(), 500U);
        EXPECT_HAS(status.message(), "kkk...");
    };
    const auto visit = [](const JsonEvent&) { return Status(); };
    expect_short(parse_flat_json("{\"" + name + "\": []}", "x").status());
    expect_short(parse_flat_json("{\"" + name + "\": 1, \"" + name + "\": 1}", "x").status());
    expect_short(parse_flat_json("{\"" + name, "x").status());
    expect_short(visit_json("{\"" + name, "x", visit));
    expect_short(parse_json("{\"" + name, "x").status());
    expect_short(parse_json_tree("{\"" + name, "x").status());
    expect_short(parse_json_tree("{\"" + name + "\": 1, \"" + name + "\": 1}", "x").status());
}

TEST(Json, FlatObjectsHaveEachNameOnce) {
    EXPECT_ERROR(parse_flat_json(R"({"a": 1, "b": 2, "a": 1})", "x"), Code::kInvalidArgument,
                 "x: 'a' appears twice");
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

/// Path and value of every event, one behind the other.
std::string events_of(const std::string& text) {
    std::string all;
    const Status status = visit_json(text, "x", [&all](const JsonEvent& event) {
        for (const JsonStep& step : event.path)
            all += "/" + (step.array ? std::to_string(step.index) : step.key);
        constexpr char kKinds[] = "nbird{[";
        all += std::string(":") + kKinds[static_cast<std::size_t>(event.kind)];
        if (event.kind == JsonEvent::Kind::kText) all += event.text;
        all += std::to_string(event.integer) + " ";
        return Status();
    });
    EXPECT_OK(status);
    return all;
}

TEST(Json, NamesThatAreNotUtf8AreRefused) {
    for (const char* good : {"", "a.b", "\xC3\xA4", "quote\" and\nline"})
        EXPECT_OK(check_json_name(good, "tensor"));
    EXPECT_ERROR(check_json_name("a\xE4", "tensor"), Code::kInvalidArgument,
                 "tensor 'a\\xe4' is not UTF-8");
    for (const char* bad : {"\xC3", "\xE4\xE4", "a\xFFz"})
        EXPECT_ERROR(check_json_name(bad, "x"), Code::kInvalidArgument, "is not UTF-8");
}

TEST(VisitJson, ReportsValuesInOrder) {
    EXPECT_EQ(events_of(R"({"a": [1, {"b": true}, []], "c": "t", "d": null, "e": 1.5})"),
              ":{0 /a:[0 /a/0:i1 /a/1:{0 /a/1/b:b1 /a/2:[0 /c:dt0 /d:n0 /e:r0 ");
    EXPECT_EQ(events_of("[18446744073709551615, -3]"), ":[0 /0:r0 /1:i-3 ");
    EXPECT_EQ(events_of("7"), ":i7 ");
}

TEST(VisitJson, RefusesInvalidJsonAndStopsOnRequest) {
    const auto visit = [](const std::string& text, const Status& answer = {}) {
        return visit_json(text, "x", [&answer](const JsonEvent&) { return answer; });
    };
    EXPECT_ERROR(visit("[1,"), Code::kInvalidArgument, "x: not valid JSON");
    EXPECT_ERROR(visit("1 2"), Code::kInvalidArgument, "x: not valid JSON");
    EXPECT_OK(visit(std::string(64, '[') + std::string(64, ']')));
    EXPECT_ERROR(visit(std::string(65, '[') + std::string(65, ']')), Code::kInvalidArgument,
                 "deeper than 64");
    EXPECT_ERROR(visit(std::string(kMaxJsonBytes + 1, ' ')), Code::kInvalidArgument, "at most");
    EXPECT_ERROR(visit("[]", error(Code::kUnsupported, "stop")), Code::kUnsupported, "stop");
}

}  // namespace
}  // namespace splat
