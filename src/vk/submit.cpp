#include "vk/submit.h"

#include <algorithm>
#include <chrono>
#include <new>

#include "core/fault.h"
#include "vk/command_list_objects.h"

namespace splat::vk {
namespace {

/// What to do where a loss may be the work of a watchdog. Source: learn.microsoft.com, "TDR registry keys".
#if defined(_WIN32)
constexpr const char* kAfterLoss =
    ". Windows takes a GPU for lost that is busy for 2 s: use smaller images, batches or scenes, "
    "lower SPLAT_MAX_SUBMIT_MS, or raise TdrDelay (seconds) in the registry's "
    "HKEY_LOCAL_MACHINE\\SYSTEM\\CurrentControlSet\\Control\\GraphicsDrivers";
#else
constexpr const char* kAfterLoss = "";
#endif

}  // namespace

Queue::~Queue() {
    // A device that neither finishes nor reports its loss hangs here: its objects cannot be destroyed
    // while it runs.
    if (pending_ == nullptr) return;
    if (!device_.adopted()) {
        device_.vk.vkDeviceWaitIdle(device_.handle());
        return;
    }
    // The application's own work may be on its queues, and is not waited for.
    for (; pending_->ended < pending_->submitted; ++pending_->ended)
        device_.vk.vkWaitForFences(device_.handle(), 1,
                                   &pending_->fences[pending_->ended % pending_->fences.size()],
                                   VK_TRUE, ~std::uint64_t{0});
}

Status Queue::make_ready(CommandList& list) {
    SPLAT_TRY(device_.alive());
    SPLAT_TRY(settle());
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
    objects.renew(0);
    objects.submitted = objects.ended = 0;
    objects.longest_seconds = 0;
    for (std::size_t i = 0; i < objects.now.segments.size(); ++i) {
        if (i >= objects.fences.size()) {
            SPLAT_TRY(wait(list.objects_, i + 1 - objects.fences.size()));
            if (!objects.goes_on(i) && !mutex_.check().ok()) break;
            if (objects.slow) objects.renew(i);
        }
        SPLAT_TRY(submit(objects, i));
    }
    SPLAT_TRY(wait(list.objects_, objects.submitted));
    objects.ran = true;
    if (!objects.goes_on(objects.submitted)) SPLAT_TRY(mutex_.check());
    if (profile == nullptr || objects.now.queries == VK_NULL_HANDLE) return {};
    try {
        return read_times(objects, *profile);
    } catch (const std::bad_alloc&) {
        return {};  // the list has run: a caller told of a failure would run it again
    }
}

Status Queue::submit(CommandList::Objects& objects, std::size_t segment) {
    VkFence& fence = objects.fences[segment % objects.fences.size()];
    SPLAT_TRY(naming_work(
        device_.check(device_.vk.vkResetFences(device_.handle(), 1, &fence), "vkResetFences"),
        objects));
    VkSubmitInfo info{.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO,
                      .commandBufferCount = 1,
                      .pCommandBuffers = &objects.now.buffers[segment]};
    objects.begins[segment % objects.begins.size()] = device_.pace.now();
    device_.pace.submitted(objects.now.estimates[segment]);
    VkResult result = VK_ERROR_DEVICE_LOST;
    if (!SPLAT_FAULT("vk.queue_submit")) {
        const QueueUse use(device_);
        result = device_.vk.vkQueueSubmit(device_.queue(), 1, &info, fence);
    }
    if (result >= VK_SUCCESS) {
        ++objects.submitted;
        return {};
    }
    if (segment > 0) {  // the segment before is running
        const QueueUse use(device_);
        device_.vk.vkQueueWaitIdle(device_.queue());
    }
    return naming_work(device_.check(result, "vkQueueSubmit"), objects);
}

Result<std::uint64_t> Queue::submit_frame(CommandList& list, const BufferView& pixels,
                                          const FrameTarget& target) {
    SPLAT_TRY(make_ready(list));
    CommandList::Objects& objects = *list.objects_;
    objects.renew(0);
    if (frames_ == nullptr) SPLAT_SET(frames_, Frames::create(device_));
    // One fence for all: as if only the last segment had not ended.
    const std::size_t last = objects.now.segments.size() - 1;
    VkFence& fence = objects.fences[last % objects.fences.size()];
    SPLAT_TRY(
        device_.check(device_.vk.vkResetFences(device_.handle(), 1, &fence), "vkResetFences"));
    SPLAT_ASSIGN(const std::uint64_t value,
                 frames_->submit(objects.now.buffers, pixels, target, fence));
    objects.ended = last;
    objects.submitted = last + 1;
    pending_ = list.objects_;
    memory_.defer_frees(Memory::Deferral::kRunning, true);
    return value;
}

/// Wait in pieces: a stop of the process, or sleep of the machine, ends one piece and not the whole wait.
VkResult Queue::wait_for(VkFence fence) const {
    constexpr std::uint64_t kPieceNs = 500'000'000;
    for (std::uint64_t left_ns = timeout_ns_;;) {
        const std::uint64_t piece = std::min(left_ns, kPieceNs);
        const VkResult result =
            device_.vk.vkWaitForFences(device_.handle(), 1, &fence, VK_TRUE, piece);
        left_ns -= piece;
        if (result != VK_TIMEOUT || left_ns == 0) return result;
    }
}

/// Learn from the time of the segment that has just ended: it began with its submit, or with the end of the one before.
void Queue::learn(CommandList::Objects& objects) const {
    const auto end = device_.pace.now();
    auto begin = objects.begins[objects.ended % objects.begins.size()];
    if (objects.ended > 0) begin = std::max(begin, objects.last_end);
    objects.last_end = end;
    const double seconds = std::chrono::duration<double>(end - begin).count();
    objects.longest_seconds = std::max(objects.longest_seconds, seconds);
    // Drivers of CPU devices compile shaders when they run first.
    if (device_.pace.watched() || objects.ran)
        objects.slow |= objects.learn(objects.now.segments[objects.ended], seconds);
}

/// Wait until the first `count` segments have ended.
Status Queue::wait(const std::shared_ptr<CommandList::Objects>& objects, std::size_t count) {
    VkResult result = VK_SUCCESS;
    for (; objects->ended < count; ++objects->ended) {
        const VkFence fence = objects->fences[objects->ended % objects->fences.size()];
        result = SPLAT_FAULT("vk.wait_timeout") ? VK_TIMEOUT : wait_for(fence);
        if (result != VK_SUCCESS) break;
        if (pending_ == nullptr) learn(*objects);
    }
    if (result == VK_SUCCESS) {
        if (objects->ended < objects->submitted) return {};
        pending_ = nullptr;
        memory_.defer_frees(Memory::Deferral::kRunning, false);
        return {};
    }
    pending_ = objects;
    memory_.defer_frees(Memory::Deferral::kRunning, true);
    if (result != VK_TIMEOUT)
        return naming_work(device_.check(result, "vkWaitForFences"), *objects);
    return naming_work(
        error(Code::kTimeout,
              "device %u (%s) did not finish within %.3f s; it may still be working. Repeat the "
              "call, or raise "
              "timeout_ns or SPLAT_TIMEOUT_SCALE",
              device_.info().index, device_.info().name.c_str(),
              static_cast<double>(timeout_ns_) * 1e-9),
        *objects);
}

/// Tell after a loss or a timeout what the device was given last and has not ended.
Status Queue::naming_work(Status status, const CommandList::Objects& objects) {
    if (status.code() != Code::kDeviceLost && status.code() != Code::kTimeout) return status;
    const ListCut& cut = objects.now;
    const std::size_t end = std::max(objects.submitted, objects.ended + 1);
    const Piece *first = nullptr, *last = nullptr, *longest = nullptr;
    const auto seconds = [&](const Piece& piece) {
        return piece.seconds * objects.commands[piece.command].pace->factor;
    };
    for (std::size_t i = cut.segments[objects.ended].first; i < cut.segments[end - 1].last; ++i) {
        const Piece& piece = cut.pieces[i];
        if (is_barrier(objects.commands[piece.command])) continue;
        if (first == nullptr) first = &piece;
        if (longest == nullptr || seconds(piece) > seconds(*longest)) longest = &piece;
        last = &piece;
    }
    if (first == nullptr) return status;
    const auto name = [&](const Piece& piece) {
        const Command& command = objects.commands[piece.command];
        return command.op + (*command.shader == '\0' ? "" : format(" (%s)", command.shader));
    };
    std::string work = name(*first);
    if (last != first)
        work += format(" to %s, most of it %s", name(*last).c_str(), name(*longest).c_str());
    return {status.code(),
            format("%s. Its last work: %s; submit %zu of %zu%s", status.message().c_str(),
                   work.c_str(), objects.ended + 1, cut.segments.size(),
                   status.code() == Code::kDeviceLost ? kAfterLoss : "")};
}

Status Queue::settle() {
    SPLAT_TRY(mutex_.check());
    if (pending_ == nullptr) return {};
    const auto objects = pending_;
    return wait(objects, objects->submitted);
}

Status Queue::read_times(const CommandList::Objects& objects, Profile& profile) {
    const ListCut& cut = objects.now;
    std::vector<std::uint64_t> ticks(2 * cut.spans.size());
    for (std::size_t i = 0; i < cut.spans.size(); ++i)
        SPLAT_TRY(
            device_.check(device_.vk.vkGetQueryPoolResults(
                              device_.handle(), cut.queries, static_cast<std::uint32_t>(2 * i), 2,
                              2 * sizeof(std::uint64_t), &ticks[2 * i], sizeof(std::uint64_t),
                              VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
                          "vkGetQueryPoolResults"));
    const DeviceLimits& limits = device_.info().limits;
    const auto between = [&](std::uint64_t from, std::uint64_t to) {
        return static_cast<double>((to - from) & limits.timestamp_mask) * limits.timestamp_ns *
               1e-6;
    };
    std::vector<double> command_ms(objects.commands.size());
    ListTotals totals{.submits = cut.segments.size(),
                      .longest_submit_ms = objects.longest_seconds * 1e3};
    for (std::size_t i = 0; i < cut.spans.size(); ++i) {
        objects.deal(cut.spans[i], between(ticks[2 * i], ticks[2 * i + 1]), command_ms);
        if (i > 0) totals.idle_ms += between(ticks[2 * i - 1], ticks[2 * i]), ++totals.gaps;
    }
    totals.device_ms = between(ticks.front(), ticks.back());
    for (const Piece& piece : cut.pieces) {
        const Command& command = objects.commands[piece.command];
        ++(is_barrier(command)                      ? totals.barriers
           : command.kind == CommandKind::kDispatch ? totals.dispatches
                                                    : totals.copies);
        if (command.kind == CommandKind::kToHost) ++totals.host_barriers;
        if (command.kind == CommandKind::kBarrier &&
            ((command.from | command.to) & kTransfers) != 0)
            ++totals.transfer_barriers;
    }
    profile.add_list(totals);
    for (std::size_t i = 0; i < objects.commands.size(); ++i) {
        const Command& command = objects.commands[i];
        if (!is_barrier(command))
            profile.add(command.op, command.shader, command_ms[i], command.work);
    }
    return {};
}

}  // namespace splat::vk
