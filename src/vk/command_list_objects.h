#pragma once

#include <array>
#include <vector>

#include "vk/command_list.h"
#include "vk/timers.h"

namespace splat::vk {

/// The Vulkan objects of one command list; private to command_list.cpp and submit.cpp.
struct CommandList::Objects : NoCopy {
    using Segment = CommandSpan;  ///< commands of one submit

    Objects() = default;
    ~Objects();

    Status make_sets();
    Status make_set(Command& command);
    void cut(const DeviceInfo& info, Kernels kernels);
    Status make_command_buffers(std::uint32_t queue_family);
    Status make_queries(bool alone);
    Status encode();  ///< once the pipelines are compiled
    void encode(VkCommandBuffer to, const Command& command);
    /// Deal the time of a span to its commands, by their estimated times.
    void deal(const CommandSpan& span, double milliseconds, std::vector<double>& command_ms) const;
    void encode_dispatch(VkCommandBuffer to, const Command& command);

    Device* device = nullptr;
    Pipelines* pipelines = nullptr;
    std::vector<Command> commands;
    std::vector<Segment> segments;
    std::vector<VkBufferView> texel_views;
    VkDescriptorPool descriptors = VK_NULL_HANDLE;
    VkCommandPool command_pool = VK_NULL_HANDLE;
    std::vector<VkCommandBuffer> buffers;  ///< one per segment
    /// Segments take turns, so that one runs and one waits in the queue; a single segment needs one.
    std::array<VkFence, 2> fences{};
    std::size_t submitted = 0;             ///< segments of the latest run
    std::size_t ended = 0;                 ///< segments that are known to have ended
    VkQueryPool queries = VK_NULL_HANDLE;  ///< begin and end of every span; null without profile
    std::vector<CommandSpan> spans;        ///< timed ones
    bool encoded = false;
};

}  // namespace splat::vk
