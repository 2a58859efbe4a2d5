#include "vk/caller/frames.h"

#include <bit>

#include "core/fault.h"

namespace splat::vk {
namespace {

VkImageMemoryBarrier image_barrier(VkImage image, VkImageLayout from, VkImageLayout to) {
    return {.sType = VK_STRUCTURE_TYPE_IMAGE_MEMORY_BARRIER,
            .pNext = nullptr,
            .srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT,
            .dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT,
            .oldLayout = from,
            .newLayout = to,
            .srcQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .dstQueueFamilyIndex = VK_QUEUE_FAMILY_IGNORED,
            .image = image,
            .subresourceRange = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 1, 0, 1}};
}

}  // namespace

Result<std::unique_ptr<Frames>> Frames::create(Device& device) {
    std::unique_ptr<Frames> made(new Frames(device));
    VkSemaphoreTypeCreateInfo type{};
    type.sType = VK_STRUCTURE_TYPE_SEMAPHORE_TYPE_CREATE_INFO;
    type.semaphoreType = VK_SEMAPHORE_TYPE_TIMELINE;
    VkSemaphoreCreateInfo semaphore{};
    semaphore.sType = VK_STRUCTURE_TYPE_SEMAPHORE_CREATE_INFO;
    semaphore.pNext = &type;
    SPLAT_TRY(device.check(
        device.vk.vkCreateSemaphore(device.handle(), &semaphore, nullptr, &made->semaphore_),
        "vkCreateSemaphore"));
    const VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                       .pNext = nullptr,
                                       .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                       .queueFamilyIndex = device.info().queue_family};
    SPLAT_TRY(
        device.check(device.vk.vkCreateCommandPool(device.handle(), &pool, nullptr, &made->pool_),
                     "vkCreateCommandPool"));
    const VkCommandBufferAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .pNext = nullptr,
        .commandPool = made->pool_,
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = 1};
    SPLAT_TRY(device.check(
        device.vk.vkAllocateCommandBuffers(device.handle(), &allocate, &made->commands_),
        "vkAllocateCommandBuffers"));
    return made;
}

Frames::~Frames() {
    if (pool_ != VK_NULL_HANDLE) device_.vk.vkDestroyCommandPool(device_.handle(), pool_, nullptr);
    if (semaphore_ != VK_NULL_HANDLE)
        device_.vk.vkDestroySemaphore(device_.handle(), semaphore_, nullptr);
}

std::uint64_t Frames::semaphore() const {
    return std::bit_cast<std::uint64_t>(semaphore_);
}

/// Barriers order the copy behind all that is in the queue before, and what comes later behind the copy.
Status Frames::record(const BufferView& pixels, const FrameTarget& target) {
    const VolkDeviceTable& vk = device_.vk;
    VkCommandBufferBeginInfo begin{};
    begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
    begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
    SPLAT_TRY(device_.check(vk.vkBeginCommandBuffer(commands_, &begin), "vkBeginCommandBuffer"));
    VkMemoryBarrier memory{};
    memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
    memory.srcAccessMask = VK_ACCESS_MEMORY_WRITE_BIT;
    memory.dstAccessMask = VK_ACCESS_MEMORY_READ_BIT | VK_ACCESS_MEMORY_WRITE_BIT;
    const std::uint32_t images = target.image != 0 ? 1 : 0;
    const auto image = std::bit_cast<VkImage>(target.image);
    constexpr VkImageLayout kWritten = VK_IMAGE_LAYOUT_TRANSFER_DST_OPTIMAL;
    VkImageMemoryBarrier change = image_barrier(image, VK_IMAGE_LAYOUT_UNDEFINED, kWritten);
    vk.vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT,
                            VK_PIPELINE_STAGE_TRANSFER_BIT, 0, 1, &memory, 0, nullptr, images,
                            &change);
    if (images != 0) {
        VkBufferImageCopy region{};
        region.bufferOffset = pixels.offset;
        region.imageSubresource = {VK_IMAGE_ASPECT_COLOR_BIT, 0, 0, 1};
        region.imageExtent = {target.width, target.height, 1};
        vk.vkCmdCopyBufferToImage(commands_, pixels.buffer, image, kWritten, 1, &region);
    } else {
        const VkBufferCopy region{pixels.offset, target.offset, pixels.bytes};
        vk.vkCmdCopyBuffer(commands_, pixels.buffer, std::bit_cast<VkBuffer>(target.buffer), 1,
                           &region);
    }
    change = image_barrier(image, kWritten, static_cast<VkImageLayout>(target.layout));
    vk.vkCmdPipelineBarrier(commands_, VK_PIPELINE_STAGE_TRANSFER_BIT,
                            VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, 0, 1, &memory, 0, nullptr, images,
                            &change);
    return device_.check(vk.vkEndCommandBuffer(commands_), "vkEndCommandBuffer");
}

Result<std::uint64_t> Frames::submit(std::span<const VkCommandBuffer> commands,
                                     const BufferView& pixels, const FrameTarget& target,
                                     VkFence fence) {
    SPLAT_TRY(record(pixels, target));
    std::vector<VkSubmitInfo> submits(commands.size() + 1);
    for (std::size_t i = 0; i < submits.size(); ++i) {
        submits[i].sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
        submits[i].commandBufferCount = 1;
        submits[i].pCommandBuffers = i < commands.size() ? &commands[i] : &commands_;
    }
    const std::uint32_t waits = target.wait_semaphore != 0 ? 1 : 0;
    const auto wait = std::bit_cast<VkSemaphore>(target.wait_semaphore);
    const VkPipelineStageFlags stage = VK_PIPELINE_STAGE_TRANSFER_BIT;
    const std::uint64_t value = value_ + 1;
    VkTimelineSemaphoreSubmitInfo values{};
    values.sType = VK_STRUCTURE_TYPE_TIMELINE_SEMAPHORE_SUBMIT_INFO;
    values.waitSemaphoreValueCount = waits;
    values.pWaitSemaphoreValues = &target.wait_value;
    values.signalSemaphoreValueCount = 1;
    values.pSignalSemaphoreValues = &value;
    VkSubmitInfo& last = submits.back();
    last.pNext = &values;
    last.waitSemaphoreCount = waits;
    last.pWaitSemaphores = &wait;
    last.pWaitDstStageMask = &stage;
    last.signalSemaphoreCount = 1;
    last.pSignalSemaphores = &semaphore_;
    VkResult result = VK_ERROR_DEVICE_LOST;
    if (!SPLAT_FAULT("vk.queue_submit")) {
        const QueueUse use(device_);
        result = device_.vk.vkQueueSubmit(
            device_.queue(), static_cast<std::uint32_t>(submits.size()), submits.data(), fence);
    }
    SPLAT_TRY(device_.check(result, "vkQueueSubmit"));
    value_ = value;
    return value;
}

}  // namespace splat::vk
