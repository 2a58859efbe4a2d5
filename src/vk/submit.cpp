#include "vk/submit.h"

#include <algorithm>

#include "core/fault.h"
#include "core/log.h"
#include "vk/command_list_objects.h"

namespace splat::vk {

Queue::~Queue() {
    // A device that neither finishes nor reports its loss hangs here: its objects cannot be destroyed
    // while it runs.
    if (pending_ != nullptr) device_.vk.vkDeviceWaitIdle(device_.handle());
}

Status Queue::make_ready(CommandList& list) {
    SPLAT_TRY(device_.alive());
    SPLAT_TRY(settle());  // a running list must not be encoded again
    if (list.objects_ == nullptr || list.objects_->encoded) return {};
    return list.objects_->encode();
}

Status Queue::run(CommandList& list, Profile* profile) {
    SPLAT_TRY(make_ready(list));
    if (list.objects_ == nullptr) return {};
    CommandList::Objects& objects = *list.objects_;
    SPLAT_TRY(submit(objects));
    SPLAT_TRY(wait(list.objects_));
    if (profile != nullptr && objects.queries != VK_NULL_HANDLE)
        SPLAT_TRY(read_times(objects, *profile));
    return mutex_.check();
}

Status Queue::submit(CommandList::Objects& objects) {
    SPLAT_TRY(device_.check(device_.vk.vkResetFences(device_.handle(), 1, &objects.fence),
                            "vkResetFences"));
    for (std::size_t i = 0; i < objects.buffers.size(); ++i) {
        VkSubmitInfo info{};
        info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
        info.commandBufferCount = 1;
        info.pCommandBuffers = &objects.buffers[i];
        const bool last = i + 1 == objects.buffers.size();
        const VkResult result =
            SPLAT_FAULT("vk.queue_submit")
                ? VK_ERROR_DEVICE_LOST
                : device_.vk.vkQueueSubmit(device_.queue(), 1, &info,
                                           last ? objects.fence : VK_NULL_HANDLE);
        if (result >= VK_SUCCESS) continue;
        if (i > 0) device_.vk.vkQueueWaitIdle(device_.queue());  // the earlier pieces are running
        return device_.check(result, "vkQueueSubmit");
    }
    return {};
}

/// Wait in pieces: a stop of the process, or sleep of the machine, ends one piece and not the whole wait.
VkResult Queue::wait_for(VkFence fence) const {
    constexpr std::uint64_t kPieceNs = 500'000'000;
    for (std::uint64_t left = timeout_ns_;; left -= kPieceNs) {
        const VkResult result = device_.vk.vkWaitForFences(device_.handle(), 1, &fence, VK_TRUE,
                                                           std::min(left, kPieceNs));
        if (result != VK_TIMEOUT || left <= kPieceNs) return result;
    }
}

Status Queue::wait(const std::shared_ptr<CommandList::Objects>& objects) {
    const VkResult result = SPLAT_FAULT("vk.wait_timeout") ? VK_TIMEOUT : wait_for(objects->fence);
    if (result != VK_TIMEOUT && result >= VK_SUCCESS) {
        pending_ = nullptr;
        memory_.defer_frees(false);
        return {};
    }
    pending_ = objects;
    memory_.defer_frees(true);
    if (result != VK_TIMEOUT) return device_.check(result, "vkWaitForFences");
    return error(Code::kTimeout,
                 "device %u (%s) did not finish within %.3f s; it may still be working. Repeat the "
                 "call, or raise "
                 "timeout_ns or SPLAT_TIMEOUT_SCALE",
                 device_.info().index, device_.info().name.c_str(),
                 static_cast<double>(timeout_ns_) * 1e-9);
}

Status Queue::settle() {
    SPLAT_TRY(mutex_.check());
    if (pending_ == nullptr) return {};
    const auto objects = pending_;
    return wait(objects);
}

Status Queue::read_times(const CommandList::Objects& objects, Profile& profile) {
    std::vector<std::uint64_t> ticks(2 * objects.commands.size());
    for (std::size_t i = 0; i < objects.commands.size(); ++i) {
        const CommandKind kind = objects.commands[i].kind;
        if (kind == CommandKind::kBarrier || kind == CommandKind::kToHost) continue;
        SPLAT_TRY(
            device_.check(device_.vk.vkGetQueryPoolResults(
                              device_.handle(), objects.queries, static_cast<std::uint32_t>(2 * i),
                              2, 2 * sizeof(std::uint64_t), &ticks[2 * i], sizeof(std::uint64_t),
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                          "vkGetQueryPoolResults"));
    }
    const DeviceLimits& limits = device_.info().limits;
    for (std::size_t i = 0;
         i < objects.commands.size();) {  // the parts of a split dispatch count as one
        const Command& command = objects.commands[i];
        double milliseconds = 0;
        Work work;
        std::size_t next = i;
        do {
            const std::uint64_t elapsed =
                (ticks[2 * next + 1] - ticks[2 * next]) & limits.timestamp_mask;
            milliseconds += static_cast<double>(elapsed) * limits.timestamp_ns * 1e-6;
            work.flops += objects.commands[next].work.flops;
            work.bytes += objects.commands[next].work.bytes;
            ++next;
        } while (next < objects.commands.size() && objects.commands[next].part > 0);
        i = next;
        if (command.kind == CommandKind::kBarrier || command.kind == CommandKind::kToHost) continue;
        profile.add(command.op, command.shader, milliseconds, work);
    }
    return {};
}

}  // namespace splat::vk
