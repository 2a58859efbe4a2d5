#pragma once

#include <nlohmann/json.hpp>
#include <string_view>

#include "core/status.h"

namespace splat {

using Json = nlohmann::ordered_json;

/// Limits for text that comes from outside (a file, the C API).
inline constexpr std::size_t kMaxJsonBytes = 16u << 20;
inline constexpr int kMaxJsonDepth = 64;

/// Parse one JSON value. Errors: kInvalidArgument with position, for text that is no JSON, is
/// larger than kMaxJsonBytes or nests deeper than kMaxJsonDepth; `what` names the text in the
/// message.
Result<Json> parse_json(std::string_view text, const char* what);

}  // namespace splat
