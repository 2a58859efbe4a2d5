#include "vk/levels.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <numeric>
#include <utility>

namespace splat::vk {
namespace {

/// The greatest levels of the commands that touched each byte of a buffer.
class Touched {
  public:
    [[nodiscard]] std::uint32_t greatest(const Access& access) {
        std::uint32_t most = 0;
        const auto last = split(access.view.end());
        for (auto at = split(access.view.offset); at != last; ++at)
            most = std::max(most, writes(access.use) ? at->second.any : at->second.write);
        return most;
    }

    void raise(const Access& access, std::uint32_t level) {
        const auto last = split(access.view.end());
        const auto first = split(access.view.offset);
        if (first == last) return;
        if (writes(access.use)) {  // above all that touched the range before
            first->second = {level, level};
            levels_.erase(std::next(first), last);
            return;
        }
        for (auto at = first; at != last; ++at) at->second.any = std::max(at->second.any, level);
    }

  private:
    struct Levels {
        std::uint32_t write = 0;
        std::uint32_t any = 0;
    };
    using Ranges = std::map<std::uint64_t, Levels>;  ///< by first byte, each to the next

    /// The range that begins at a byte.
    Ranges::iterator split(std::uint64_t byte) {
        const auto next = levels_.lower_bound(byte);
        if (next != levels_.end() && next->first == byte) return next;
        const Levels before = next == levels_.begin() ? Levels() : std::prev(next)->second;
        return levels_.emplace_hint(next, byte, before);
    }

    Ranges levels_;
};

/// Set the stages of all barriers.
void name_stages(std::vector<Command>& commands) {
    Stages used = 0;
    std::map<Stages, Stages> open = {{kShaders, kAllStages},
                                     {kTransfers, kAllStages}};  // by stage after
    for (auto at = commands.begin(); at != commands.end(); ++at) {
        if (at->kind == CommandKind::kToHost) {
            at->from = used;
            at->to = kHost;
        } else if (at->kind == CommandKind::kBarrier) {
            for (auto next = std::next(at); next != commands.end() && !is_barrier(*next); ++next)
                at->to |= stages_of(*next);
            for (auto& [stage, before] : open)
                if ((at->to & stage) != 0) at->from |= std::exchange(before, 0);
        } else {
            used |= stages_of(*at);
            for (auto& [stage, before] : open) before |= stages_of(*at);
        }
    }
}

}  // namespace

std::vector<std::uint32_t> dependency_levels(std::span<const Command> commands, bool in_order) {
    std::map<VkBuffer, Touched> buffers;
    std::vector<std::uint32_t> levels;
    levels.reserve(commands.size());
    for (const Command& command : commands) {
        std::uint32_t level = in_order && !levels.empty() ? levels.back() : 1;
        for (const Access& access : command.accesses)
            level = std::max(level, buffers[access.view.buffer].greatest(access) + 1);
        for (const Access& access : command.accesses)
            buffers[access.view.buffer].raise(access, level);
        levels.push_back(level);
    }
    return levels;
}

std::vector<Command> in_levels(std::vector<Command> commands,
                               std::span<const std::uint32_t> levels) {
    std::vector<std::size_t> order(commands.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return levels[i]; });
    std::vector<Command> made;
    const std::uint32_t most = levels.empty() ? 0 : std::ranges::max(levels);
    made.reserve(commands.size() + most + 1);
    const auto barrier = [&](CommandKind kind, const char* op) {
        made.emplace_back();
        made.back().kind = kind;
        made.back().op = op;
    };
    std::uint32_t level = 0;
    for (const std::size_t i : order) {
        if (levels[i] != level) barrier(CommandKind::kBarrier, "barrier");
        level = levels[i];
        made.push_back(std::move(commands[i]));
    }
    if (!made.empty()) barrier(CommandKind::kToHost, "to_host");
    name_stages(made);
    return made;
}

}  // namespace splat::vk
