#include "core/json.h"

namespace splat {

Result<Json> parse_json(std::string_view text, const char* what) {
    if (text.size() > kMaxJsonBytes)
        return error(Code::kInvalidArgument, "%s: %zu bytes of JSON, expected at most %zu", what,
                     text.size(), kMaxJsonBytes);
    bool too_deep = false;
    const auto guard = [&too_deep](int depth, Json::parse_event_t event, Json&) {
        const bool opens =
            event == Json::parse_event_t::object_start || event == Json::parse_event_t::array_start;
        too_deep = too_deep || (opens && depth >= kMaxJsonDepth);
        return !too_deep;
    };
    try {
        Json value = Json::parse(text, guard);
        if (too_deep)
            return error(Code::kInvalidArgument, "%s: JSON nests deeper than %d levels", what,
                         kMaxJsonDepth);
        return value;
    } catch (const Json::exception& e) {
        return error(Code::kInvalidArgument, "%s: not valid JSON: %s", what, e.what());
    }
}

}  // namespace splat
