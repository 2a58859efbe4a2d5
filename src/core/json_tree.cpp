#include "core/json_tree.h"

#include <algorithm>
#include <cmath>

#include "core/fork.h"
#include "core/json.h"
#include "core/shown.h"

namespace splat {
namespace {

/// A new element or member of an array or object.
JsonTree& added(JsonTree& container, const std::string& name) {
    if (auto* const list = std::get_if<JsonTree::List>(&container.value))
        return list->emplace_back();
    return std::get<JsonTree::Object>(container.value)
        .emplace_back(JsonTree::Member{name, {}})
        .tree;
}

Status check_names(const JsonTree& tree, const char* what) {
    std::vector<std::string_view> names;
    if (tree.is_object())
        for (const JsonTree::Member& member : std::get<JsonTree::Object>(tree.value))
            names.emplace_back(member.name);
    std::ranges::sort(names);
    const auto twice = std::ranges::adjacent_find(names);
    if (twice == names.end()) return {};
    return invalid("%s: '%s' appears twice in an object", what, shown(*twice).c_str());
}

decltype(JsonTree::value) value_of(const JsonEvent& event) {
    using Kind = JsonEvent::Kind;
    if (event.kind == Kind::kBool) return event.integer != 0;
    if (event.kind == Kind::kInteger) return static_cast<double>(event.integer);
    if (event.kind == Kind::kReal) return event.real;
    if (event.kind == Kind::kText) return std::string(event.text);
    if (event.kind == Kind::kObject) return JsonTree::Object();
    if (event.kind == Kind::kArray) return JsonTree::List();
    return std::monostate();
}

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
    const JsonTree* const found = find(name);
    return found == nullptr ? for_ever<JsonTree>() : *found;
}

const JsonTree::List& JsonTree::items() const {
    return list() == nullptr ? for_ever<List>() : *list();
}

Result<JsonTree> parse_json_tree(std::string_view text, const char* what) {
    JsonTree root;
    std::vector<JsonTree*>
        open;  // containers around the next value; they do not move before they are closed
    const auto close_to = [&](std::size_t depth) -> Status {
        for (; open.size() > depth; open.pop_back()) SPLAT_TRY(check_names(*open.back(), what));
        return {};
    };
    const auto take = [&](const JsonEvent& event) -> Status {
        SPLAT_TRY(close_to(event.path.size()));
        JsonTree& at = open.empty() ? root : added(*open.back(), event.path.back().key);
        at.value = value_of(event);
        if (at.is_object() || at.list() != nullptr) open.push_back(&at);
        return {};
    };
    SPLAT_TRY(visit_json(text, what, take));
    SPLAT_TRY(close_to(0));
    return root;
}

}  // namespace splat
