#include "vk/submit.h"

#include <algorithm>
#include <chrono>
#include <new>

#include "core/fault.h"
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
    for (const Command& command : list.objects_->commands) {
        if (command.pipeline == nullptr) continue;
        SPLAT_TRY(mutex_.check());
        SPLAT_TRY(list.objects_->pipelines->wait(*command.pipeline));
    }
    return list.objects_->encode();
}

Status Queue::run(CommandList& list, Profile* profile) {
    SPLAT_TRY(make_ready(list));
    if (list.objects_ == nullptr) return {};
    CommandList::Objects& objects = *list.objects_;
    objects.submitted = objects.ended = 0;
    std::uint64_t left_ns = timeout_ns_;
    for (std::size_t i = 0; i < objects.segments.size(); ++i) {
        if (i >= objects.fences.size()) {
            SPLAT_TRY(wait(list.objects_, i + 1 - objects.fences.size(), left_ns));
            if (!mutex_.check().ok()) break;
        }
        SPLAT_TRY(submit(objects, i));
    }
    SPLAT_TRY(wait(list.objects_, objects.submitted, left_ns));
    SPLAT_TRY(mutex_.check());
    if (profile == nullptr || objects.queries == VK_NULL_HANDLE) return {};
    try {
        return read_times(objects, *profile);
    } catch (const std::bad_alloc&) {
        return {};  // the list has run: a caller told of a failure would run it again
    }
}

Status Queue::submit(CommandList::Objects& objects, std::size_t segment) {
    VkFence& fence = objects.fences[segment % objects.fences.size()];
    SPLAT_TRY(
        device_.check(device_.vk.vkResetFences(device_.handle(), 1, &fence), "vkResetFences"));
    VkSubmitInfo info{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                      .commandBufferCount = 1,
                      .pCommandBuffers = &objects.buffers[segment]};
    const VkResult result = SPLAT_FAULT("vk.queue_submit")
                                ? VK_ERROR_DEVICE_LOST
                                : device_.vk.vkQueueSubmit(device_.queue(), 1, &info, fence);
    if (result >= VK_SUCCESS) {
        ++objects.submitted;
        return {};
    }
    if (segment > 0) device_.vk.vkQueueWaitIdle(device_.queue());  // the segment before is running
    return device_.check(result, "vkQueueSubmit");
}

/// Wait in pieces: a stop of the process, or sleep of the machine, ends one piece and not the whole wait.
VkResult Queue::wait_for(VkFence fence, std::uint64_t& left_ns) const {
    using Clock = std::chrono::steady_clock;
    constexpr std::uint64_t kPieceNs = 500'000'000;
    for (;;) {
        const std::uint64_t piece = std::min(left_ns, kPieceNs);
        const auto begin = Clock::now();
        const VkResult result =
            device_.vk.vkWaitForFences(device_.handle(), 1, &fence, VK_TRUE, piece);
        if (result == VK_TIMEOUT) {
            left_ns -= piece;
            if (left_ns == 0) return result;
            continue;
        }
        const std::chrono::nanoseconds waited = Clock::now() - begin;
        left_ns -= std::min(static_cast<std::uint64_t>(waited.count()), piece);
        return result;
    }
}

/// Wait until the first `count` segments have ended.
Status Queue::wait(const std::shared_ptr<CommandList::Objects>& objects, std::size_t count,
                   std::uint64_t& left_ns) {
    VkResult result = VK_SUCCESS;
    for (; objects->ended < count; ++objects->ended) {
        const VkFence fence = objects->fences[objects->ended % objects->fences.size()];
        result = SPLAT_FAULT("vk.wait_timeout") ? VK_TIMEOUT : wait_for(fence, left_ns);
        if (result != VK_SUCCESS) break;
    }
    if (result == VK_SUCCESS) {
        if (objects->ended < objects->submitted) return {};
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
    std::uint64_t left_ns = timeout_ns_;
    return wait(objects, objects->submitted, left_ns);
}

Status Queue::read_times(const CommandList::Objects& objects, Profile& profile) {
    std::vector<std::uint64_t> ticks(2 * objects.spans.size());
    for (std::size_t i = 0; i < objects.spans.size(); ++i)
        SPLAT_TRY(
            device_.check(device_.vk.vkGetQueryPoolResults(
                              device_.handle(), objects.queries, static_cast<std::uint32_t>(2 * i),
                              2, 2 * sizeof(std::uint64_t), &ticks[2 * i], sizeof(std::uint64_t),
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                          "vkGetQueryPoolResults"));
    const DeviceLimits& limits = device_.info().limits;
    const auto between = [&](std::uint64_t from, std::uint64_t to) {
        return static_cast<double>((to - from) & limits.timestamp_mask) * limits.timestamp_ns *
               1e-6;
    };
    std::vector<double> command_ms(objects.commands.size());
    ListTotals totals{.submits = objects.segments.size()};
    for (std::size_t i = 0; i < objects.spans.size(); ++i) {
        objects.deal(objects.spans[i], between(ticks[2 * i], ticks[2 * i + 1]), command_ms);
        if (i > 0) totals.idle_ms += between(ticks[2 * i - 1], ticks[2 * i]), ++totals.gaps;
    }
    totals.device_ms = between(ticks.front(), ticks.back());
    for (const Command& command : objects.commands)
        ++(is_barrier(command)                      ? totals.barriers
           : command.kind == CommandKind::kDispatch ? totals.dispatches
                                                    : totals.copies);
    profile.add_list(totals);
    for (std::size_t i = 0;
         i < objects.commands.size();) {  // the parts of a split dispatch count as one
        const Command& command = objects.commands[i];
        double milliseconds = 0;
        Work work;
        do {
            milliseconds += command_ms[i];
            work.flops += objects.commands[i].work.flops;
            work.bytes += objects.commands[i].work.bytes;
            ++i;
        } while (i < objects.commands.size() && objects.commands[i].part > 0);
        if (!is_barrier(command)) profile.add(command.op, command.shader, milliseconds, work);
    }
    return {};
}

}  // namespace splat::vk
