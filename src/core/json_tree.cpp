#include "core/json_tree.h"

#include <algorithm>
#include <cmath>

#include "core/json.h"
#include "core/shown.h"

namespace splat {
namespace {

/// Receives the events of nlohmann's parser; returning false stops it.
class TreeReader : public nlohmann::json_sax<Json> {
  public:
    bool null() override { return add(std::monostate()); }
    bool boolean(bool value) override { return add(value); }
    bool number_integer(number_integer_t value) override { return add(static_cast<double>(value)); }
    bool number_unsigned(number_unsigned_t value) override {
        return add(static_cast<double>(value));
    }
    bool number_float(number_float_t value, const string_t&) override { return add(value); }
    bool string(string_t& value) override { return add(std::move(value)); }
    bool binary(binary_t&) override { return false; }  // not in text
    bool start_object(std::size_t) override { return open(JsonTree::Object()); }
    bool key(string_t& name) override {
        name_ = std::move(name);
        return true;
    }
    bool end_object() override { return close(); }
    bool start_array(std::size_t) override { return open(JsonTree::List()); }
    bool end_array() override { return close(); }
    bool parse_error(std::size_t, const std::string&, const Json::exception& e) override {
        problem = invalid_json(e);
        return false;
    }

    JsonTree root;
    std::string problem;

  private:
    /// Where the next value goes.
    JsonTree& place() {
        if (open_.empty()) return root;
        if (auto* const list = std::get_if<JsonTree::List>(&open_.back()->value))
            return list->emplace_back();
        auto& members = std::get<JsonTree::Object>(open_.back()->value);
        auto& [name, tree] = members.emplace_back();
        name = std::move(name_);
        return tree;
    }

    template <class T>
    bool add(T value) {
        place().value = std::move(value);
        return true;
    }

    template <class T>
    bool open(T container) {
        if (open_.size() >= std::size_t{kMaxJsonDepth}) {
            problem = format("JSON nests deeper than %d levels", kMaxJsonDepth);
            return false;
        }
        JsonTree& at = place();
        at.value = std::move(container);
        open_.push_back(&at);  // does not move until it is closed
        return true;
    }

    bool close() {
        const auto* const members = std::get_if<JsonTree::Object>(&open_.back()->value);
        open_.pop_back();
        return members == nullptr || check_names(*members);
    }

    bool check_names(const JsonTree::Object& members) {
        names_.clear();
        for (const JsonTree::Member& member : members) names_.emplace_back(member.name);
        std::ranges::sort(names_);
        const auto twice = std::ranges::adjacent_find(names_);
        if (twice == names_.end()) return true;
        problem = "'" + shown(*twice) + "' appears twice in an object";
        return false;
    }

    std::vector<JsonTree*> open_;
    std::string name_;
    std::vector<std::string_view> names_;
};

}  // namespace

std::optional<double> JsonTree::number() const {
    const double* const held = std::get_if<double>(&value);
    return held == nullptr ? std::optional<double>() : *held;
}

std::optional<std::uint64_t> JsonTree::count() const {
    constexpr double kMost = 9007199254740992;  // 2^53: all whole numbers up to it are doubles
    const auto held = number();
    if (!held || !(*held >= 0 && *held <= kMost) || std::floor(*held) != *held) return std::nullopt;
    return static_cast<std::uint64_t>(*held);
}

const JsonTree* JsonTree::find(std::string_view name) const {
    const auto* const members = std::get_if<Object>(&value);
    if (members == nullptr) return nullptr;
    for (auto member = members->rbegin(); member != members->rend(); ++member)
        if (member->name == name) return &member->tree;
    return nullptr;
}

const JsonTree& JsonTree::operator[](std::string_view name) const {
    static const JsonTree null;
    const JsonTree* const found = find(name);
    return found == nullptr ? null : *found;
}

const JsonTree::List& JsonTree::items() const {
    static const List none;
    return list() == nullptr ? none : *list();
}

Result<JsonTree> parse_json_tree(std::string_view text, const char* what) {
    SPLAT_TRY(check_json_text(text, what));
    TreeReader reader;
    if (!Json::sax_parse(text, &reader)) return invalid("%s: %s", what, reader.problem.c_str());
    return std::move(reader.root);
}

}  // namespace splat
