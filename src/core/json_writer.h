#pragma once

#include <concepts>
#include <string>
#include <string_view>

#include "core/json.h"

namespace splat {

/// Writes JSON text front to back, without a tree: nlohmann's tree ends the process when memory has run out
/// (see parse_flat_json), so entry points of the C API use this.
///
///     JsonWriter json;
///     json.begin_object().member("name", name).key("dims").list(dims).end();
///     return json.text();  // {"name": "x", "dims": [1, 2]}
///
/// An unbalanced text, or a member without a key, is a defect of the library (SPLAT_ASSERT).
class JsonWriter {
  public:
    /// kSpaced writes `{"a": 1, "b": 2}`, kCompact `{"a":1,"b":2}`.
    enum class Style { kSpaced, kCompact };

    explicit JsonWriter(Style style = Style::kSpaced) : compact_(style == Style::kCompact) {}

    JsonWriter& begin_object() { return open('{', '}'); }
    JsonWriter& begin_array() { return open('[', ']'); }
    JsonWriter& end();  ///< closes the innermost object or array

    JsonWriter& key(std::string_view name);

    JsonWriter& value(bool flag) { return raw(flag ? "true" : "false"); }
    JsonWriter& value(std::integral auto number) { return raw(std::to_string(number)); }
    JsonWriter& value(float number) { return this->number(static_cast<double>(number), 9); }
    JsonWriter& value(double number) { return this->number(number, 17); }
    JsonWriter& value(std::string_view text) { return raw(json_quote(text)); }
    JsonWriter& value(const std::string& text) { return value(std::string_view(text)); }
    JsonWriter& value(const char* text) { return value(std::string_view(text)); }

    /// With at most this many significant digits; NaN and infinities, which JSON lacks, become null.
    JsonWriter& number(double value, int digits);

    /// A value given as JSON text.
    JsonWriter& raw(std::string_view json);

    /// An array of plain values.
    template <class Range>
    JsonWriter& list(const Range& items) {
        begin_array();
        for (const auto& item : items) value(item);
        return end();
    }

    template <class Value>
    JsonWriter& member(std::string_view name, const Value& content) {
        return key(name).value(content);
    }

    /// Start the next member, element or closing bracket on a new line, after `indent` blanks.
    JsonWriter& newline(int indent = 0);

    /// The whole text; every object and array must be closed.
    [[nodiscard]] std::string text();

  private:
    JsonWriter& open(char begin, char end);
    void separate();  ///< from the preceding member or element

    std::string text_;
    std::string open_;  ///< the brackets that end() will write
    bool compact_;
    bool first_ = true;  ///< this object or array is still empty
    bool has_key_ = false;
    int indent_ = -1;  ///< spaces before the next line; -1: no line break
};

}  // namespace splat
