#include "core/json_writer.h"
#include "support/parsed_json.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <vector>

namespace splat {
namespace {

TEST(JsonWriter, WritesEveryKindOfValue) {
    JsonWriter json;
    json.begin_object().member("text", "a\"b").member("yes", true).member("least", INT64_MIN);
    json.member("most", UINT64_MAX).member("float", 0.1F).member("double", 0.1);
    json.key("short").number(1.0 / 3, 3).key("none").list(std::vector<int>{});
    json.key("names").list(std::vector<std::string>{"x", "y"}).key("given").raw("{}").end();
    const std::string text = json.text();
    EXPECT_EQ(text,
              "{\"text\": \"a\\\"b\", \"yes\": true, \"least\": -9223372036854775808, "
              "\"most\": 18446744073709551615, \"float\": 0.100000001, "
              "\"double\": 0.10000000000000001, \"short\": 0.333, \"none\": [], "
              "\"names\": [\"x\", \"y\"], \"given\": {}}");
    EXPECT_TRUE(parse_json(text, "text").ok());
}

TEST(JsonWriter, NestsAndBreaksLines) {
    JsonWriter json;
    json.begin_array();
    for (int i = 0; i < 2; ++i) json.newline(1).begin_object().member("i", i).end();
    json.begin_array().begin_array().end().end().end();
    EXPECT_EQ(json.text(), "[\n {\"i\": 0},\n {\"i\": 1}, [[]]]");
    JsonWriter map;
    map.begin_object().newline(2).key("a").begin_object().newline(4).member("b", 1);
    map.newline(2).end().newline(0).end();
    EXPECT_EQ(map.text(), "{\n  \"a\": {\n    \"b\": 1\n  }\n}");
}

TEST(JsonWriter, CompactHasNoBlanks) {
    JsonWriter json(JsonWriter::Style::kCompact);
    json.begin_object().member("a", 1).key("b").list(std::vector<int>{2, 3}).end();
    EXPECT_EQ(json.text(), "{\"a\":1,\"b\":[2,3]}");
}

TEST(JsonWriter, NumbersThatJsonLacksAreNull) {
    JsonWriter json;
    json.begin_array().value(std::numeric_limits<double>::infinity());
    json.value(std::numeric_limits<float>::quiet_NaN()).end();
    EXPECT_EQ(json.text(), "[null, null]");
}

}  // namespace
}  // namespace splat
