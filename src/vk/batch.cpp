#include "vk/batch.h"

#include <algorithm>
#include <optional>

#include "vk/context.h"
#include "vk/hazard.h"

namespace splat::vk {

bool Noted::same(const Noted& other) const {
    return kind == other.kind && word == other.word && whole == other.whole &&
           from.same_range(other.from) && to.same_range(other.to) &&
           (kind != CommandKind::kDispatch || &list.commands() == &other.list.commands());
}

bool Noted::touches(const BufferView& view) const {
    if (kind != CommandKind::kDispatch) return to.overlaps(view) || from.overlaps(view);
    return std::ranges::any_of(list.commands(), [&](const Command& command) {
        return std::ranges::any_of(
            command.accesses, [&](const Access& access) { return access.view.overlaps(view); });
    });
}

double Noted::estimated_seconds() const {
    double sum = 0;
    for (const Command& command : list.commands())
        if (command.pace != nullptr) sum += command.seconds * command.pace->factor;
    return sum;
}

Result<CommandList*> Batch::join(Context& context, const std::vector<Noted>& work) {
    const auto same = [](const Noted& a, const Noted& b) { return a.same(b); };
    const auto found = std::ranges::find_if(
        lists_, [&](const Joined& one) { return std::ranges::equal(one.work, work, same); });
    if (found != lists_.end()) {
        std::rotate(lists_.begin(), found, found + 1);
        return &lists_.front().list;
    }
    Joined made{work, {}};
    if (work.size() == 1 && work[0].kind == CommandKind::kDispatch && !work[0].whole) {
        made.list = work[0].list;
    } else {
        std::vector<Command> commands;
        std::optional<std::size_t> whole;  // where what is not cancelled begins
        // Each list begins with a barrier; only the end of the last one is kept, for the stages of all.
        const auto append = [&](const CommandList& list, bool is_whole) {
            Stages used = 0;
            if (!commands.empty()) {
                used = commands.back().from;
                commands.pop_back();
            }
            const std::size_t first = commands.size();
            if (is_whole && !whole) whole = first;
            commands.insert(commands.end(), list.commands().begin(), list.commands().end());
            for (std::size_t i = first; i < commands.size(); ++i) commands[i].recorded += first;
            commands.back().from |= used;
        };
        for (std::size_t i = 0; i < work.size();) {
            const bool is_whole = work[i].whole;
            if (work[i].kind == CommandKind::kDispatch) {
                append(work[i++].list, is_whole);
                continue;
            }
            Recorder recorder(context);
            for (; i < work.size() && work[i].kind != CommandKind::kDispatch; ++i)
                SPLAT_TRY(work[i].kind == CommandKind::kCopy
                              ? recorder.copy(work[i].from, work[i].to)
                              : recorder.fill(work[i].to, work[i].word));
            SPLAT_ASSIGN(const CommandList transfers, recorder.finish());
            append(transfers, is_whole);
        }
#ifndef NDEBUG
        SPLAT_TRY(check_hazards(commands));
#endif
        SPLAT_ASSIGN(made.list, CommandList::create(context, std::move(commands)));
        if (whole) made.list.set_whole_from(*whole);
    }
    if (lists_.size() == most_) lists_.pop_back();
    lists_.insert(lists_.begin(), std::move(made));
    return &lists_.front().list;
}

BatchScope::BatchScope(Context& context, Batch& batch)
    : context_(context), outer_(context.batch_ == nullptr) {
    if (outer_) context_.batch_ = &batch;
}

BatchScope::~BatchScope() {
    if (!outer_) return;
    context_.drop(std::move(context_.noted_));
    context_.batch_ = nullptr;
    context_.charge = nullptr;
}

Status BatchScope::finish() {
    return outer_ ? context_.flush() : Status();
}

}  // namespace splat::vk
