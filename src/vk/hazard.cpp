#include "vk/hazard.h"

#include <algorithm>
#include <array>
#include <map>

namespace splat::vk {
namespace {

constexpr Stages kStages[] = {kShaders, kTransfers};

const char* use_name(Use use) {
    constexpr const char* kNames[] = {"read", "write", "read-modify-write"};
    return kNames[static_cast<std::size_t>(use)];
}

/// An access and the position of its command in the list.
struct Touch {
    std::size_t command;
    const Access* access;
};

class Checker {
  public:
    explicit Checker(std::span<const Command> commands);

    [[nodiscard]] Status ends() const;
    [[nodiscard]] Status pair(const Touch& a, const Touch& b) const;

  private:
    /// Position of the first barrier after `begin` that orders one stage against another; that of the end if none.
    [[nodiscard]] std::size_t next_barrier(Stages from, Stages to, std::size_t begin) const {
        return next_[from - 1][to - 1][begin];
    }

    std::span<const Command> commands_;
    std::array<std::array<std::vector<std::size_t>, 2>, 2> next_;  ///< by stages - 1 and position
};

Checker::Checker(std::span<const Command> commands) : commands_(commands) {
    for (const Stages from : kStages)
        for (const Stages to : kStages) {
            std::vector<std::size_t>& next = next_[from - 1][to - 1];
            next.assign(commands.size() + 1, commands.size());
            for (std::size_t i = commands.size(); i-- > 0;) {
                const Command& command = commands[i];
                const bool orders = command.kind == CommandKind::kBarrier &&
                                    (command.from & from) != 0 && (command.to & to) != 0;
                next[i] = orders ? i : next[i + 1];
            }
        }
}

Status Checker::ends() const {
    if (commands_.front().kind != CommandKind::kBarrier)
        return error(Code::kInternal,
                     "hazard: the list does not begin with a barrier against the one before it");
    if (commands_.back().kind != CommandKind::kToHost)
        return error(Code::kInternal, "hazard: the list does not end with a barrier to the host");
    for (std::size_t i = 0; i < commands_.size(); ++i) {
        if (is_barrier(commands_[i])) continue;
        const Stages stage = stages_of(commands_[i]);
        if ((commands_.back().from & stage) == 0)
            return error(Code::kInternal, "hazard: the host does not wait for command %zu (%s)", i,
                         commands_[i].op.c_str());
        for (const Stages before : kStages)
            if (next_barrier(before, stage, 0) > i)
                return error(Code::kInternal,
                             "hazard: command %zu (%s) has no barrier against the lists before", i,
                             commands_[i].op.c_str());
    }
    return {};
}

/// Two accesses to overlapping ranges.
Status Checker::pair(const Touch& a, const Touch& b) const {
    if (a.command == b.command || (!writes(a.access->use) && !writes(b.access->use))) return {};
    const Touch& first = a.command < b.command ? a : b;
    const Touch& second = a.command < b.command ? b : a;
    const Command& earlier = commands_[first.command];
    const Command& later = commands_[second.command];
    const bool ordered =
        next_barrier(stages_of(earlier), stages_of(later), first.command) < second.command;
    if (ordered && earlier.recorded < later.recorded) return {};
    return error(
        Code::kInternal,
        "hazard: command %zu (%s) and command %zu (%s) %s and %s bytes [%llu, "
        "%llu) and [%llu, %llu) of one buffer %s",
        first.command, earlier.op.c_str(), second.command, later.op.c_str(),
        use_name(first.access->use), use_name(second.access->use), llu(first.access->view.offset),
        llu(first.access->view.end()), llu(second.access->view.offset),
        llu(second.access->view.end()),
        ordered ? "in another order than they were recorded" : "without a barrier between them");
}

}  // namespace

Status check_hazards(std::span<const Command> commands) {
    if (commands.empty()) return {};
    const Checker checker(commands);
    SPLAT_TRY(checker.ends());
    std::map<VkBuffer, std::vector<Touch>> buffers;
    for (std::size_t i = 0; i < commands.size(); ++i)
        for (const Access& access : commands[i].accesses)
            buffers[access.view.buffer].push_back({i, &access});
    for (auto& [buffer, touches] : buffers) {
        std::ranges::sort(touches, {}, [](const Touch& t) { return t.access->view.offset; });
        for (std::size_t i = 0; i < touches.size(); ++i)
            for (std::size_t j = i + 1; j < touches.size() && touches[j].access->view.offset <
                                                                  touches[i].access->view.end();
                 ++j)
                SPLAT_TRY(checker.pair(touches[i], touches[j]));
    }
    return {};
}

}  // namespace splat::vk
