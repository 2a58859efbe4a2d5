#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <vector>

#include "vk/command_list.h"
#include "vk/timers.h"

namespace splat::vk {

/// One way to run a list in segments, each the pieces of one submit.
struct ListCut {
    std::vector<Piece> pieces;
    std::vector<PieceSpan> segments;
    std::vector<double> estimates;         ///< segment by segment, not by what is measured
    double longest = 0;                    ///< segment by the factors of that time, seconds
    std::vector<VkCommandBuffer> buffers;  ///< one per segment
    VkQueryPool queries = VK_NULL_HANDLE;  ///< begin and end of every span; null without profile
    std::vector<PieceSpan> spans;          ///< timed ones
};

/// The Vulkan objects of one command list; private to command_list.cpp, list_cut.cpp and submit.cpp.
struct CommandList::Objects : NoCopy {
    Objects() = default;
    ~Objects();

    Status make_sets();
    Status make_set(Command& command);

    /// The list in segments that take no longer than one submit may, by what is known of its kernels. The first
    /// `kept` segments stay those of `now`, which has more.
    [[nodiscard]] ListCut cut(std::size_t kept) const;
    /// All of a command.
    [[nodiscard]] Piece whole(std::size_t i) const {
        return {i, {0, 0, 0}, commands[i].groups, commands[i].seconds};
    }
    /// kInternal if a kernel takes too long for a submit, by its estimate, and cannot be split.
    [[nodiscard]] Status check_estimates() const;
    /// Expected time of the longest segment from `first` on.
    [[nodiscard]] double longest(const ListCut& cut, std::size_t first) const;
    /// True if by what was measured since a segment from `first` on would take much longer than one submit may, or the
    /// list needs half as many.
    [[nodiscard]] bool outdated(std::size_t first) const;
    /// Cut an encoded list anew from segment `first` on if it is outdated. It stays as it is where memory is short.
    void renew(std::size_t first) noexcept;
    /// Learn from the time of a segment. True if it took longer than expected.
    bool learn(const PieceSpan& segment, double seconds);

    Status make_command_buffers(ListCut& cut, std::size_t first);
    Status make_queries(ListCut& cut) const;
    void destroy(ListCut& cut, std::size_t first);
    Status encode();  ///< once the pipelines are compiled
    Status encode(const ListCut& cut, std::size_t first);
    void encode(VkCommandBuffer to, const Command& command, const Piece& piece);
    /// Deal the time of a span to its commands, by their estimated times.
    void deal(const PieceSpan& span, double milliseconds, std::vector<double>& command_ms) const;
    void encode_dispatch(VkCommandBuffer to, const Command& command, const Piece& piece);

    Device* device = nullptr;
    Pipelines* pipelines = nullptr;
    std::vector<Command> commands;
    /// True if a run that has submitted the segments before `segment` must go on to its end.
    [[nodiscard]] bool goes_on(std::size_t segment) const {
        return segment == now.segments.size()
                   ? whole_from < commands.size()
                   : now.pieces[now.segments[segment].first].command > whole_from;
    }

    ListCut now;
    std::size_t whole_from = SIZE_MAX;  ///< command
    std::vector<VkBufferView> texel_views;
    VkDescriptorPool descriptors = VK_NULL_HANDLE;
    VkCommandPool command_pool = VK_NULL_HANDLE;
    /// Segments take turns, so that one runs and one waits in the queue; a single segment needs one.
    std::array<VkFence, 2> fences{};
    std::size_t submitted = 0;                       ///< segments of the latest run
    std::size_t ended = 0;                           ///< segments that are known to have ended
    std::chrono::steady_clock::time_point last_end;  ///< when a segment of the latest run ended
    std::array<std::chrono::steady_clock::time_point, 2> begins{};  ///< times of submits, as fences
    double longest_seconds = 0;                                     ///< segment of the latest run
    std::uint64_t changes = 0;  ///< Pace::changes() when the list was last found not to be outdated
    bool slow = false;          ///< segments took longer than expected since
    bool timed = false;         ///< for a profile
    bool alone = false;         ///< each command is timed alone
    bool encoded = false;
    bool ran = false;  ///< at least once
};

}  // namespace splat::vk
