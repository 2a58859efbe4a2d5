// One JSON text as nlohmann's tree, for tests; the library reads JSON by visit_json() and parse_json_tree().

#pragma once

#include "core/json.h"

namespace splat {

/// Errors: those of visit_json().
inline Result<Json> parse_json(std::string_view text, const char* what) {
    SPLAT_TRY(check_json_text(text, what));
    bool too_deep = false;
    const auto guard = [&too_deep](int depth, Json::parse_event_t event, Json&) {
        const bool opens =
            event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
        too_deep = too_deep || (opens && depth >= kMaxJsonDepth);
        return !too_deep;
    };
    try {
        Json value = Json::parse(text, guard);
        if (too_deep) return invalid("%s: JSON nests deeper than %d levels", what, kMaxJsonDepth);
        return value;
    } catch (const Json::exception& e) {
        return invalid("%s: %s", what, invalid_json(e).c_str());
    }
}

}  // namespace splat
