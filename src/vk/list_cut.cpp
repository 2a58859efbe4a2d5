#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "vk/command_list_objects.h"
#include "vk/context.h"

namespace splat::vk {
namespace {

/// A submit in which data put more work than its share takes at most as many times the longest one.
constexpr double kUneven = 5;
/// No submit is estimated to take longer by the rates of recorder.h, which leaves a watchdog of 2 s some room.
constexpr double kMostEstimate = 0.5;

/// Planned seconds of groups of a command if `segments` have its kernel already.
double planned(const Pace& pace, const Command& command, const Piece& range, int segments) {
    const double factor = pace.planned(*command.pace, segments);
    const double even = range.seconds * factor;
    const bool short_enough = command.seconds * factor <= kUneven * pace.submit_seconds();
    if (!pace.watched() || short_enough) return even;
    const double groups = double{1} * range.groups[0] * range.groups[1] * range.groups[2];
    return std::max(even, command.group_seconds * groups * factor / kUneven);
}

/// Cuts the pieces of a list into segments.
class Cutter {
  public:
    Cutter(const Pace& pace, const std::vector<Command>& commands, ListCut& cut);

    /// Add a command or a part of it, in pieces along its longest axis of groups if one submit does not take it.
    void add(Piece range);
    void close();

  private:
    const Pace& pace_;
    const std::vector<Command>& commands_;
    ListCut& cut_;
    std::size_t first_;    ///< piece of the open segment
    double seconds_ = 0;   ///< planned, of the open segment
    double estimate_ = 0;  ///< before anything is measured, of the open segment
};

Cutter::Cutter(const Pace& pace, const std::vector<Command>& commands, ListCut& cut)
    : pace_(pace), commands_(commands), cut_(cut), first_(cut.pieces.size()) {
    for (const Command& command : commands) {
        if (command.pace == nullptr) continue;
        command.pace->segments = 0;
        command.pace->in_segment = 0;
    }
}

void Cutter::add(Piece range) {
    const Command& command = commands_[range.command];
    if (command.pace == nullptr) {
        cut_.pieces.push_back(range);
        return;
    }
    const bool whole =
        command.pipeline != nullptr && command.pipeline->interface.uses_num_workgroups;
    const double most = pace_.submit_seconds();
    const auto axis =
        static_cast<std::size_t>(std::ranges::max_element(range.groups) - range.groups.begin());
    const bool one = range.groups[axis] == 1;
    while (range.groups[axis] > 0) {
        const double seconds = planned(pace_, command, range, command.pace->segments);
        if (seconds_ > 0 && seconds_ + seconds > most) {
            close();
            continue;
        }
        if (whole || one || seconds <= most) {
            seconds_ += seconds;
            estimate_ += range.seconds;
            cut_.pieces.push_back(range);
            return;
        }
        const std::uint32_t rest = range.groups[axis];
        const double parts = std::min(std::ceil(seconds / most), static_cast<double>(rest));
        Piece first = range;
        first.groups[axis] = rest / static_cast<std::uint32_t>(parts);
        first.seconds = range.seconds * first.groups[axis] / rest;
        range.base[axis] += first.groups[axis];
        range.groups[axis] -= first.groups[axis];
        range.seconds -= first.seconds;
        add(first);  // along another axis if it is a single row of groups
    }
}

void Cutter::close() {
    if (first_ == cut_.pieces.size()) return;
    cut_.segments.push_back({first_, cut_.pieces.size()});
    cut_.estimates.push_back(std::exchange(estimate_, 0));
    for (; first_ < cut_.pieces.size(); ++first_) {
        KernelPace* kernel = commands_[cut_.pieces[first_].command].pace;
        if (kernel == nullptr || kernel->in_segment == cut_.segments.size()) continue;
        kernel->in_segment = cut_.segments.size();
        ++kernel->segments;
    }
    seconds_ = 0;
}

}  // namespace

ListCut CommandList::Objects::cut(std::size_t kept) const {
    ListCut made;
    const std::size_t first = kept > 0 ? now.segments[kept].first : 0;
    if (kept > 0) {
        made.pieces.assign(now.pieces.data(), now.pieces.data() + first);
        made.segments.assign(now.segments.data(), now.segments.data() + kept);
        made.estimates.assign(now.estimates.data(), now.estimates.data() + kept);
        made.buffers.assign(now.buffers.data(), now.buffers.data() + kept);
    }
    Cutter cutter(device->pace, commands, made);
    if (kept > 0)
        for (std::size_t i = first; i < now.pieces.size(); ++i) cutter.add(now.pieces[i]);
    else
        for (std::size_t i = 0; i < commands.size(); ++i) cutter.add(whole(i));
    cutter.close();
    made.longest = longest(made, kept);
    return made;
}

double CommandList::Objects::longest(const ListCut& cut, std::size_t first) const {
    double most = 0;
    for (; first < cut.segments.size(); ++first) {
        double seconds = 0;
        for (std::size_t i = cut.segments[first].first; i < cut.segments[first].last; ++i)
            if (const KernelPace* kernel = commands[cut.pieces[i].command].pace)
                seconds += cut.pieces[i].seconds * kernel->factor;
        most = std::max(most, seconds);
    }
    return most;
}

Status CommandList::Objects::check_estimates() const {
    // What is planned to fit a submit is estimated at no more than its time by the least factor.
    const double most = std::max(kMostEstimate, device->pace.submit_seconds() / Pace::kLeastFactor);
    for (std::size_t i = 0; i < now.segments.size(); ++i) {
        if (now.estimates[i] <= most) continue;
        const Piece* longest = &now.pieces[now.segments[i].first];
        for (std::size_t p = now.segments[i].first; p < now.segments[i].last; ++p)
            if (now.pieces[p].seconds > longest->seconds) longest = &now.pieces[p];
        const Command& command = commands[longest->command];
        return error(Code::kInternal,
                     "%s (%s): a submit is estimated at %.3g s, expected at most %.3g s; give it "
                     "more workgroups",
                     command.op.c_str(), command.shader, now.estimates[i], most);
    }
    return {};
}

bool CommandList::Objects::outdated(std::size_t first) const {
    constexpr double kMuchLonger = 1.5;
    const double most = device->pace.submit_seconds();
    if (longest(now, first) > kMuchLonger * std::max(most, now.longest)) return true;
    if (first > 0) return false;
    double all = 0;
    for (std::size_t i = 0; i < commands.size(); ++i)
        if (commands[i].pace != nullptr) all += planned(device->pace, commands[i], whole(i), 0);
    // Two segments that follow each other in a new cut take more together than one submit may.
    return static_cast<double>(now.segments.size()) > 2 * all / most + 2;
}

void CommandList::Objects::renew(std::size_t first) noexcept {
    if (first == 0) {
        if (changes == device->pace.changes()) return;
        changes = device->pace.changes();
    }
    slow = false;
    if ((first > 0 && timed) || !outdated(first)) return;  // spans are counted from the first on
    try {
        ListCut next = cut(first);
        Status made = make_command_buffers(next, first);
        if (made.ok() && timed) made = make_queries(next);
        if (made.ok()) made = encode(next, first);
        if (made.ok()) std::swap(now, next);
        destroy(next, first);
    } catch (const std::bad_alloc&) {
        return;  // what was allocated is freed with its pool
    }
}

bool CommandList::Objects::learn(const PieceSpan& segment, double seconds) {
    double expected = 0;
    for (std::size_t i = segment.first; i < segment.last; ++i) {
        KernelPace* kernel = commands[now.pieces[i].command].pace;
        if (kernel == nullptr) continue;
        kernel->seconds += now.pieces[i].seconds;
        expected += now.pieces[i].seconds * kernel->factor;
    }
    bool rose = false;
    for (std::size_t i = segment.first; i < segment.last; ++i)
        if (KernelPace* kernel = commands[now.pieces[i].command].pace)
            rose |= device->pace.learn(*kernel, seconds, seconds / expected);
    return rose;
}

}  // namespace splat::vk
