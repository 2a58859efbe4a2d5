#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/status.h"

namespace splat {

/// A JSON value from outside. Unlike nlohmann's it is destroyed without allocating, so that a reader can
/// give up when memory has run out; see parse_flat_json.
struct JsonTree {
    struct Member;
    using List = std::vector<JsonTree>;
    using Object = std::vector<Member>;

    std::variant<std::monostate, bool, double, std::string, List, Object> value;

    [[nodiscard]] bool is_null() const { return value.index() == 0; }
    [[nodiscard]] bool is_object() const { return std::holds_alternative<Object>(value); }
    /// Nothing if it is not a number.
    [[nodiscard]] std::optional<double> number() const;
    /// Nothing if it is not a whole number from 0 to 2^53.
    [[nodiscard]] std::optional<std::uint64_t> count() const;
    /// Null if it is not a string or array.
    [[nodiscard]] const std::string* text() const { return std::get_if<std::string>(&value); }
    [[nodiscard]] const List* list() const { return std::get_if<List>(&value); }
    /// The elements of an array; none of anything else.
    [[nodiscard]] const List& items() const;
    /// The member of this name, or null.
    [[nodiscard]] const JsonTree* find(std::string_view name) const;
    /// The same, with a JSON null for a member that is not there.
    const JsonTree& operator[](std::string_view name) const;
};

struct JsonTree::Member {
    std::string name;
    JsonTree tree;
};

/// Parse one JSON value of at most kMaxJsonBytes and kMaxJsonDepth levels. Errors: kInvalidArgument
/// with position; `what` names the text in the message. Precision: integers beyond 2^53 are rounded.
Result<JsonTree> parse_json_tree(std::string_view text, const char* what);

}  // namespace splat
