#pragma once

#include <array>
#include <memory>
#include <vector>

#include "vk/command_list.h"

namespace splat::vk {

/// The Vulkan objects of one command list; private to command_list.cpp and submit.cpp.
struct CommandList::Objects {
    struct Segment {  ///< commands [first, last) of one submit
        std::size_t first;
        std::size_t last;
    };

    Objects() = default;
    ~Objects();
    Objects(const Objects&) = delete;
    Objects& operator=(const Objects&) = delete;

    Status make_sets();
    Status make_set(Command& command);
    void cut(const DeviceInfo& info, Kernels kernels);
    Status make_command_buffers(std::uint32_t queue_family);
    Status make_queries();
    Status encode();  ///< once the pipelines are compiled
    void encode(VkCommandBuffer to, std::size_t index);
    void encode_dispatch(VkCommandBuffer to, const Command& command);

    Device* device = nullptr;
    Pipelines* pipelines = nullptr;
    std::vector<Command> commands;
    std::vector<Segment> segments;
    std::vector<VkBufferView> texel_views;
    VkDescriptorPool descriptors = VK_NULL_HANDLE;
    VkCommandPool command_pool = VK_NULL_HANDLE;
    std::vector<VkCommandBuffer> buffers;  ///< one per segment
    /// Of segments by turns, so that one runs and one waits in the queue; a single segment has one.
    std::array<VkFence, 2> fences{};
    std::size_t submitted = 0;             ///< segments of the latest run
    std::size_t ended = 0;                 ///< those that are known to have ended
    VkQueryPool queries = VK_NULL_HANDLE;  ///< begin and end of every command; null without profile
    bool encoded = false;
};

}  // namespace splat::vk
