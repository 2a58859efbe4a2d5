#include "train/optimiser_groups.h"

#include <algorithm>
#include <unordered_set>

namespace splat::train {
namespace {

bool sets_a_number(const OptimiserGroup& group) {
    return group.rate_factor != 0 || group.betas[0] != 0 || group.betas[1] != 0 || group.eps != 0;
}

OptimiserRule rule_of(const OptimiserGroup& group, OptimiserRule rule) {
    if (group.rate_factor != 0) rule.rate_factor = group.rate_factor;
    for (std::size_t i = 0; i < 2; ++i)
        if (group.betas[i] != 0) rule.betas[i] = group.betas[i];
    if (group.eps != 0) rule.eps = group.eps;
    return rule;
}

/// What became of a group's pattern.
struct Use {
    bool matches = false;  ///< a name
    bool has = false;      ///< a parameter
    bool keeps = false;    ///< one from a later group
};

}  // namespace

bool matches_pattern(std::string_view pattern, std::string_view name) {
    std::size_t p = 0, n = 0;
    std::size_t star = std::string_view::npos, from = 0;  // the last '*', and where its text ends
    while (n < name.size()) {
        if (p < pattern.size() && pattern[p] == '*') {
            star = p++;
            from = n;
        } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
            ++p;
            ++n;
        } else if (star != std::string_view::npos) {
            p = star + 1;
            n = ++from;
        } else {
            return false;
        }
    }
    return pattern.find_first_not_of('*', p) == std::string_view::npos;
}

Status apply_groups(OptimiserDesc& desc, const OptimiserRule& base,
                    std::span<const OptimiserGroup> groups) {
    std::vector<Use> uses(groups.size());
    for (OptimiserParameter& parameter : desc.parameters) {
        parameter.rule = 0;
        for (std::size_t i = 0; i < groups.size(); ++i) {
            if (!matches_pattern(groups[i].pattern, parameter.name)) continue;
            uses[i].matches = true;
            if (parameter.rule == 0) {
                parameter.rule = i + 1;
                uses[i].has = true;
            } else {
                uses[parameter.rule - 1].keeps = true;
            }
        }
    }
    for (std::size_t i = 0; i < groups.size(); ++i) {
        const char* pattern = groups[i].pattern.c_str();
        if (!uses[i].matches)
            return invalid(
                "optimizer: the pattern '%s' of group %zu matches none of the %zu "
                "parameters, such as '%s'",
                pattern, i, desc.parameters.size(),
                desc.parameters.empty() ? "" : desc.parameters.front().name.c_str());
        if (!uses[i].has)
            return invalid(
                "optimizer: group %zu ('%s') has no effect, as groups before it have all "
                "parameters that it matches: list it earlier",
                i, pattern);
        if (!sets_a_number(groups[i]) && !uses[i].keeps)
            return invalid(
                "optimizer: group %zu ('%s') has no effect: it sets neither a rate, betas "
                "nor eps",
                i, pattern);
    }
    desc.rules = {base};
    for (const OptimiserGroup& group : groups) desc.rules.push_back(rule_of(group, base));
    return {};
}

Result<std::vector<std::size_t>> find_parameters(std::span<const OptimiserParameter> parameters,
                                                 std::string_view pattern) {
    std::vector<std::size_t> found;
    for (std::size_t i = 0; i < parameters.size(); ++i)
        if (matches_pattern(pattern, parameters[i].name)) found.push_back(i);
    if (!found.empty()) return found;
    return invalid("optimizer: the pattern '%s' matches none of the %zu parameters, such as '%s'",
                   std::string(pattern).c_str(), parameters.size(),
                   parameters.empty() ? "" : parameters.front().name.c_str());
}

Status check_distinct(const OptimiserDesc& desc) {
    if (desc.parameters.empty()) return invalid("optimizer: no parameters, expected at least one");
    std::unordered_set<std::string> names;
    std::vector<const OptimiserParameter*> places;
    for (const OptimiserParameter& parameter : desc.parameters) {
        if (!names.insert(parameter.name).second)
            return invalid(
                "optimizer: two parameters are named '%s': give one of them another name "
                "or prefix",
                parameter.name.c_str());
        places.push_back(&parameter);
    }
    std::sort(places.begin(), places.end(), [](const auto* a, const auto* b) {
        return std::pair(a->value.buffer, a->value.offset) <
               std::pair(b->value.buffer, b->value.offset);
    });
    for (std::size_t i = 1; i < places.size(); ++i)
        if (places[i]->value.overlaps(places[i - 1]->value))
            return invalid("optimizer: '%s' and '%s' are the same parameter, expected it once",
                           places[i - 1]->name.c_str(), places[i]->name.c_str());
    return {};
}

}  // namespace splat::train
