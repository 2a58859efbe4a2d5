#pragma once

#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/status.h"

namespace splat {

using Json = nlohmann::ordered_json;

/// Limits for text from outside (a file, the C API).
inline constexpr std::size_t kMaxJsonBytes = 16u << 20;
inline constexpr int kMaxJsonDepth = 64;

/// "not valid JSON: " and the parser's reason, cut where it quotes a long text.
std::string invalid_json(const Json::exception& reason);

/// The checks of every parser here, before it starts. Errors: kInvalidArgument for a text of more than
/// kMaxJsonBytes, and for a NUL, also an escaped one, at which parsers stop.
Status check_json_text(std::string_view text, const char* what);

/// The second of them, for parsers of other texts too.
Status check_no_nul(std::string_view text, const char* what);

/// A member of a flat JSON object.
struct JsonScalar {
    std::string name;
    std::variant<std::int64_t, double, bool> value;
};

/// Parse an object of numbers and booleans without building a tree: nlohmann's tree allocates when it is
/// destroyed, which ends the process when memory has run out, so entry points of the C API must not use
/// it. Errors: kInvalidArgument for anything but such an object.
Result<std::vector<JsonScalar>> parse_flat_json(std::string_view text, const char* what);

/// One step on the way to a value: a member of an object, or an element of an array.
struct JsonStep {
    std::string key;        ///< empty in an array
    std::size_t index = 0;  ///< in an array
    bool array = false;
};

/// A value, or the start of an object or array; only members of its kind are valid.
struct JsonEvent {
    enum class Kind { kNull, kBool, kInteger, kReal, kText, kObject, kArray };
    Kind kind = Kind::kNull;
    std::span<const JsonStep> path = {};  ///< from the outermost value inwards
    std::int64_t integer = 0;             ///< integer or bool
    double real = 0;                      ///< real, or a whole number of more than 63 bits
    std::string_view text = {};
};

/// Report the values of a JSON text in their order, without building a tree (see parse_flat_json). Errors:
/// kInvalidArgument with position, for text that is not JSON, as check_json_text(), or where it nests deeper than
/// kMaxJsonDepth, `what` names the text in the message; and the first error that `visit` returns.
Status visit_json(std::string_view text, const char* what,
                  const std::function<Status(const JsonEvent&)>& visit);

/// Refuses a name that JSON cannot hold. `what` says what has the name. Errors: kInvalidArgument unless
/// it is UTF-8.
Status check_json_name(std::string_view name, const char* what);

/// A JSON string: quoted and escaped; invalid UTF-8 becomes U+FFFD.
std::string json_quote(std::string_view text);

}  // namespace splat
