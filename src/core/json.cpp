#include "core/json.h"

namespace splat {
namespace {

/// Receives the events of nlohmann's parser; returning false stops it.
class FlatReader : public nlohmann::json_sax<Json> {
  public:
    bool null() override { return refuse("null"); }
    bool boolean(bool value) override { return add(value); }
    bool number_integer(number_integer_t value) override { return add(value); }
    bool number_unsigned(number_unsigned_t value) override {
        if (value > static_cast<number_unsigned_t>(INT64_MAX))
            return add(static_cast<double>(value));
        return add(static_cast<std::int64_t>(value));
    }
    bool number_float(number_float_t value, const string_t&) override { return add(value); }
    bool string(string_t&) override { return refuse("a string"); }
    bool binary(binary_t&) override { return refuse("binary data"); }
    bool start_object(std::size_t) override { return open_++ == 0 || refuse("an object"); }
    bool key(string_t& name) override {
        name_ = name;
        return true;
    }
    bool end_object() override { return true; }
    bool start_array(std::size_t) override { return refuse("an array"); }
    bool end_array() override { return true; }
    bool parse_error(std::size_t, const std::string&, const Json::exception& e) override {
        problem = std::string("not valid JSON: ") + e.what();
        return false;
    }

    std::vector<JsonScalar> members;
    std::string problem;

  private:
    template <class T>
    bool add(T value) {
        if (open_ == 0) return refuse("a bare value");
        members.push_back({name_, value});
        return true;
    }
    bool refuse(const char* kind) {
        problem = (open_ == 0 ? std::string() : "'" + name_ + "' is ") + kind + ", expected " +
                  (open_ == 0 ? "a JSON object" : "a number, true or false");
        return false;
    }

    int open_ = 0;
    std::string name_;
};

}  // namespace

Result<std::vector<JsonScalar>> parse_flat_json(std::string_view text, const char* what) {
    if (text.size() > kMaxJsonBytes)
        return error(Code::kInvalidArgument, "%s: %zu bytes of JSON, expected at most %zu", what,
                     text.size(), kMaxJsonBytes);
    FlatReader reader;
    if (!Json::sax_parse(text, &reader))
        return error(Code::kInvalidArgument, "%s: %s", what, reader.problem.c_str());
    return std::move(reader.members);
}

std::string json_quote(std::string_view text) {
    return Json(text).dump(-1, ' ', false, Json::error_handler_t::replace);
}

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
