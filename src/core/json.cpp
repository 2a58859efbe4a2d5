#include "core/json.h"

#include <set>

#include "core/shown.h"

namespace splat {
namespace {

/// Where the text has the escape of a NUL, at which users of a string may stop; npos: nowhere.
std::size_t find_escaped_nul(std::string_view text) {
    constexpr std::string_view kNul = "\\u0000";
    std::size_t at = text.find(kNul);
    for (; at != std::string_view::npos; at = text.find(kNul, at + kNul.size())) {
        std::size_t before = 0;  // an odd number of backslashes before it escape its own
        while (before < at && text[at - before - 1] == '\\') ++before;
        if (before % 2 == 0) break;
    }
    return at;
}

/// What messages call a value that a flat object does not hold, by JsonEvent::Kind.
constexpr const char* kKinds[] = {"null",     "a bare value", "a bare value", "a bare value",
                                  "a string", "an object",    "an array"};

const char* kind_of(const JsonEvent& event) {
    return kKinds[static_cast<std::size_t>(event.kind)];
}

/// Receives the events of nlohmann's parser; returning false stops it. Keeps the path to the value that comes next.
class PathReader : public nlohmann::json_sax<Json> {
  public:
    using Kind = JsonEvent::Kind;

    explicit PathReader(const std::function<Status(const JsonEvent&)>& visit) : visit_(visit) {}

    bool null() override { return value({}); }
    bool boolean(bool is) override { return value({.kind = Kind::kBool, .integer = is ? 1 : 0}); }
    bool number_integer(number_integer_t number) override {
        return value({.kind = Kind::kInteger, .integer = number});
    }
    bool number_unsigned(number_unsigned_t number) override {
        if (number > static_cast<number_unsigned_t>(INT64_MAX))
            return value({.kind = Kind::kReal, .real = static_cast<double>(number)});
        return value({.kind = Kind::kInteger, .integer = static_cast<std::int64_t>(number)});
    }
    bool number_float(number_float_t number, const string_t&) override {
        return value({.kind = Kind::kReal, .real = number});
    }
    bool string(string_t& text) override { return value({.kind = Kind::kText, .text = text}); }
    bool binary(binary_t&) override { return false; }
    bool start_object(std::size_t) override { return open(Kind::kObject); }
    bool key(string_t& name) override {
        path_.back().key = name;
        return true;
    }
    bool end_object() override { return close(); }
    bool start_array(std::size_t) override { return open(Kind::kArray); }
    bool end_array() override { return close(); }
    bool parse_error(std::size_t, const std::string&, const Json::exception& e) override {
        problem = invalid_json(e);
        return false;
    }

    std::string problem;  ///< problem in the text
    Status refusal;       ///< what the visitor returned

  private:
    bool value(JsonEvent event) {
        event.path = path_;
        refusal = visit_(event);
        step();
        return refusal.ok();
    }
    bool open(Kind kind) {
        refusal = visit_({.kind = kind, .path = path_});
        if (path_.size() == static_cast<std::size_t>(kMaxJsonDepth))
            problem = "JSON nests deeper than " + std::to_string(kMaxJsonDepth) + " levels";
        path_.push_back({"", 0, kind == Kind::kArray});
        return refusal.ok() && problem.empty();
    }
    bool close() {
        path_.pop_back();
        step();
        return true;
    }
    void step() {
        if (!path_.empty() && path_.back().array) ++path_.back().index;
    }

    const std::function<Status(const JsonEvent&)>& visit_;
    std::vector<JsonStep> path_;
};

}  // namespace

std::string invalid_json(const Json::exception& reason) {
    constexpr std::size_t kMost = 400;  // bytes
    return "not valid JSON: " + shown(reason.what(), kMost);
}

Status check_json_text(std::string_view text, const char* what) {
    if (text.size() > kMaxJsonBytes)
        return invalid("%s: %zu bytes of JSON, expected at most %zu", what, text.size(),
                       kMaxJsonBytes);
    SPLAT_TRY(check_no_nul(text, what));
    const std::size_t nul = find_escaped_nul(text);
    if (nul == std::string_view::npos) return {};
    return invalid("%s: an escaped NUL (\\u0000) at byte %zu of %zu, expected a text without one",
                   what, nul, text.size());
}

Status check_no_nul(std::string_view text, const char* what) {
    const std::size_t nul = text.find('\0');
    if (nul == std::string_view::npos) return {};
    return invalid(
        "%s: a NUL at byte %zu of %zu, expected text; is the file damaged, or of another "
        "format?",
        what, nul, text.size());
}

Result<std::vector<JsonScalar>> parse_flat_json(std::string_view text, const char* what) {
    std::vector<JsonScalar> members;
    std::set<std::string> names;
    SPLAT_TRY(visit_json(text, what, [&](const JsonEvent& event) -> Status {
        using Kind = JsonEvent::Kind;
        if (event.path.empty()) {
            if (event.kind == Kind::kObject) return {};
            return invalid("%s: %s, expected a JSON object", what, kind_of(event));
        }
        const std::string& name = event.path[0].key;
        if (!names.insert(name).second)
            return invalid("%s: '%s' appears twice", what, shown(name).c_str());
        if (event.kind == Kind::kBool)
            members.push_back({name, event.integer != 0});
        else if (event.kind == Kind::kInteger)
            members.push_back({name, event.integer});
        else if (event.kind == Kind::kReal)
            members.push_back({name, event.real});
        else
            return invalid("%s: '%s' is %s, expected a number, true or false", what,
                           shown(name).c_str(), kind_of(event));
        return {};
    }));
    return members;
}

Status visit_json(std::string_view text, const char* what,
                  const std::function<Status(const JsonEvent&)>& visit) {
    SPLAT_TRY(check_json_text(text, what));
    PathReader reader(visit);
    if (Json::sax_parse(text, &reader)) return {};
    if (!reader.refusal.ok()) return reader.refusal;
    return invalid("%s: %s", what, reader.problem.c_str());
}

Status check_json_name(std::string_view name, const char* what) {
    try {
        static_cast<void>(Json(name).dump());
        return {};
    } catch (const Json::exception&) {
        std::string text;
        for (const char c : name) {
            const auto byte = static_cast<unsigned char>(c);
            text += byte < 0x80 ? std::string(1, c) : format("\\x%02x", unsigned{byte});
        }
        return invalid("%s '%s' is not UTF-8, expected a name that JSON can hold; rename it", what,
                       shown(text).c_str());
    }
}

std::string json_quote(std::string_view text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace splat
