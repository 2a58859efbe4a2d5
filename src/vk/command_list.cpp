#include "vk/command_list.h"

#include <algorithm>

#include "core/fault.h"
#include "vk/command_list_objects.h"
#include "vk/context.h"

namespace splat::vk {
namespace {

VkFormat texel_format(DescriptorType type) {
    switch (type) {
        case DescriptorType::kUintTexelBuffer:
            return VK_FORMAT_R32_UINT;
        case DescriptorType::kIntQuadTexelBuffer:
            return VK_FORMAT_R32G32B32A32_SINT;
        default:
            return VK_FORMAT_R32G32B32A32_SFLOAT;
    }
}

VkFlags flags_of(Stages stages, VkFlags shaders, VkFlags transfers, VkFlags host) {
    return ((stages & kShaders) != 0 ? shaders : 0) | ((stages & kTransfers) != 0 ? transfers : 0) |
           ((stages & kHost) != 0 ? host : 0);
}

VkPipelineStageFlags pipeline_stages(Stages stages) {
    return flags_of(stages, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_TRANSFER_BIT,
                    VK_PIPELINE_STAGE_HOST_BIT);
}

VkAccessFlags writes_of(Stages stages) {
    return flags_of(stages, VK_ACCESS_SHADER_WRITE_BIT, VK_ACCESS_TRANSFER_WRITE_BIT, 0);
}

VkAccessFlags reads_of(Stages stages) {
    return flags_of(stages, VK_ACCESS_SHADER_READ_BIT, VK_ACCESS_TRANSFER_READ_BIT,
                    VK_ACCESS_HOST_READ_BIT);
}

/// The bytes of a piece of a fill or copy.
BufferView transferred(const BufferView& view, const Piece& piece) {
    const std::uint64_t begin = piece.base[0] * kTransferPiece;
    return view.part(begin, std::min(view.bytes - begin, piece.groups[0] * kTransferPiece));
}

}  // namespace

CommandList::Objects::~Objects() {
    if (device == nullptr) return;
    const VkDevice handle = device->handle();
    for (const VkBufferView view : texel_views)
        device->vk.vkDestroyBufferView(handle, view, nullptr);
    if (now.queries != VK_NULL_HANDLE) device->vk.vkDestroyQueryPool(handle, now.queries, nullptr);
    if (now.buffers.size() == 1 && now.buffers[0] != VK_NULL_HANDLE &&
        fences[0] != VK_NULL_HANDLE && device->spare.size() < Device::kMostSpare) {
        device->spare.push_back({command_pool, now.buffers[0], fences[0]});
        command_pool = VK_NULL_HANDLE;
        fences[0] = VK_NULL_HANDLE;
    }
    for (const VkFence fence : fences)
        if (fence != VK_NULL_HANDLE) device->vk.vkDestroyFence(handle, fence, nullptr);
    if (descriptors != VK_NULL_HANDLE)
        device->vk.vkDestroyDescriptorPool(handle, descriptors, nullptr);
    if (command_pool != VK_NULL_HANDLE)
        device->vk.vkDestroyCommandPool(handle, command_pool, nullptr);
}

Status CommandList::Objects::make_sets() {
    std::uint32_t sets = 0;
    std::uint32_t storage = 0;
    std::uint32_t texel = 0;
    for (const Command& command : commands) {
        if (command.kind != CommandKind::kDispatch) continue;
        ++sets;
        for (const ShaderBinding& binding : command.pipeline->interface.bindings)
            ++(binding.type == DescriptorType::kStorageBuffer ? storage : texel);
    }
    if (sets == 0) return {};
    std::vector<VkDescriptorPoolSize> sizes;
    if (storage > 0) sizes.push_back({VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, storage});
    if (texel > 0) sizes.push_back({VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER, texel});
    VkDescriptorPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO,
                                    .maxSets = sets,
                                    .poolSizeCount = static_cast<std::uint32_t>(sizes.size()),
                                    .pPoolSizes = sizes.data()};
    SPLAT_TRY(device->check(
        SPLAT_FAULT("vk.create_descriptor_pool")
            ? VK_ERROR_FRAGMENTED_POOL
            : device->vk.vkCreateDescriptorPool(device->handle(), &pool, nullptr, &descriptors),
        "vkCreateDescriptorPool"));
    for (Command& command : commands) {
        if (command.kind == CommandKind::kDispatch) SPLAT_TRY(make_set(command));
    }
    return {};
}

Status CommandList::Objects::make_set(Command& command) {
    VkDescriptorSetAllocateInfo allocate{.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO,
                                         .descriptorPool = descriptors,
                                         .descriptorSetCount = 1,
                                         .pSetLayouts = &command.pipeline->set_layout};
    SPLAT_TRY(device->check(
        device->vk.vkAllocateDescriptorSets(device->handle(), &allocate, &command.set),
        "vkAllocateDescriptorSets"));
    const auto& bindings = command.pipeline->interface.bindings;
    std::vector<VkDescriptorBufferInfo> ranges(bindings.size());
    std::vector<VkWriteDescriptorSet> sets(bindings.size());
    texel_views.reserve(texel_views.size() + bindings.size());
    for (std::size_t i = 0; i < bindings.size(); ++i) {
        const BufferView& view = command.accesses[i].view;
        sets[i].sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
        sets[i].dstSet = command.set;
        sets[i].dstBinding = bindings[i].binding;
        sets[i].descriptorCount = 1;
        if (bindings[i].type == DescriptorType::kStorageBuffer) {
            ranges[i] = {view.buffer, view.offset, view.bytes};
            sets[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
            sets[i].pBufferInfo = &ranges[i];
            continue;
        }
        VkBufferViewCreateInfo info{.sType = VK_STRUCTURE_TYPE_BUFFER_VIEW_CREATE_INFO,
                                    .buffer = view.buffer,
                                    .format = texel_format(bindings[i].type),
                                    .offset = view.offset,
                                    .range = view.bytes};
        VkBufferView texels = VK_NULL_HANDLE;
        SPLAT_TRY(
            device->check(device->vk.vkCreateBufferView(device->handle(), &info, nullptr, &texels),
                          "vkCreateBufferView"));
        texel_views.push_back(texels);
        sets[i].descriptorType = VK_DESCRIPTOR_TYPE_UNIFORM_TEXEL_BUFFER;
        sets[i].pTexelBufferView = &texel_views.back();
    }
    device->vk.vkUpdateDescriptorSets(device->handle(), static_cast<std::uint32_t>(sets.size()),
                                      sets.data(), 0, nullptr);
    return {};
}

/// Make buffers for the segments from `first` on.
Status CommandList::Objects::make_command_buffers(ListCut& cut, std::size_t first) {
    if (command_pool == VK_NULL_HANDLE && cut.segments.size() == 1 && !device->spare.empty()) {
        const CommandBuffer& spare = device->spare.back();
        cut.buffers = {spare.buffer};  // the only step that can throw comes first
        command_pool = spare.pool;
        fences[0] = spare.fence;
        device->spare.pop_back();
        return {};
    }
    VkCommandPoolCreateInfo pool{.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO,
                                 .flags = VK_COMMAND_POOL_CREATE_RESET_COMMAND_BUFFER_BIT,
                                 .queueFamilyIndex = device->info().queue_family};
    if (command_pool == VK_NULL_HANDLE)
        SPLAT_TRY(device->check(
            SPLAT_FAULT("vk.create_command_pool")
                ? VK_ERROR_OUT_OF_DEVICE_MEMORY
                : device->vk.vkCreateCommandPool(device->handle(), &pool, nullptr, &command_pool),
            "vkCreateCommandPool"));
    cut.buffers.resize(cut.segments.size());
    VkCommandBufferAllocateInfo allocate{
        .sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO,
        .commandPool = command_pool,
        .level = VK_COMMAND_BUFFER_LEVEL_PRIMARY,
        .commandBufferCount = static_cast<std::uint32_t>(cut.buffers.size() - first)};
    SPLAT_TRY(device->check(
        device->vk.vkAllocateCommandBuffers(device->handle(), &allocate, &cut.buffers[first]),
        "vkAllocateCommandBuffers"));
    VkFenceCreateInfo info{};
    info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
    for (std::size_t i = 0; i < std::min(fences.size(), cut.segments.size()); ++i)
        if (fences[i] == VK_NULL_HANDLE)
            SPLAT_TRY(device->check(
                SPLAT_FAULT("vk.create_fence")
                    ? VK_ERROR_OUT_OF_HOST_MEMORY
                    : device->vk.vkCreateFence(device->handle(), &info, nullptr, &fences[i]),
                "vkCreateFence"));
    return {};
}

Status CommandList::Objects::make_queries(ListCut& cut) const {
    cut.spans = timed_spans(commands, cut.pieces, cut.segments, alone);
    if (cut.spans.empty()) return {};
    VkQueryPoolCreateInfo info{.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO,
                               .queryType = VK_QUERY_TYPE_TIMESTAMP,
                               .queryCount = static_cast<std::uint32_t>(2 * cut.spans.size())};
    return device->check(
        device->vk.vkCreateQueryPool(device->handle(), &info, nullptr, &cut.queries),
        "vkCreateQueryPool");
}

/// Free the queries of a cut and its buffers from `first` on.
void CommandList::Objects::destroy(ListCut& cut, std::size_t first) {
    if (cut.queries != VK_NULL_HANDLE)
        device->vk.vkDestroyQueryPool(device->handle(), cut.queries, nullptr);
    // One call made all from `first` on. Wine's Vulkan takes no null ones.
    if (cut.buffers.size() > first && cut.buffers[first] != VK_NULL_HANDLE)
        device->vk.vkFreeCommandBuffers(device->handle(), command_pool,
                                        static_cast<std::uint32_t>(cut.buffers.size() - first),
                                        &cut.buffers[first]);
}

Status CommandList::Objects::encode() {
    SPLAT_TRY(encode(now, 0));
    encoded = true;
    return {};
}

/// Encode the segments from `first` on; it is 0 if they are timed.
Status CommandList::Objects::encode(const ListCut& cut, std::size_t first) {
    const VolkDeviceTable& vk = device->vk;
    const std::vector<PieceSpan>& spans = cut.spans;
    std::size_t span = 0;
    const auto stamp = [&](VkCommandBuffer to, std::size_t end) {
        vk.vkCmdWriteTimestamp(to, VK_PIPELINE_STAGE_ALL_COMMANDS_BIT, cut.queries,
                               static_cast<std::uint32_t>(2 * span + end));
    };
    for (std::size_t i = first; i < cut.segments.size(); ++i) {
        const VkCommandBuffer to = cut.buffers[i];
        VkCommandBufferBeginInfo begin{};
        begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
        SPLAT_TRY(device->check(vk.vkBeginCommandBuffer(to, &begin), "vkBeginCommandBuffer"));
        for (std::size_t p = cut.segments[i].first; p < cut.segments[i].last; ++p) {
            const bool stamped = cut.queries != VK_NULL_HANDLE && span < spans.size();
            if (stamped && p == spans[span].first) {
                vk.vkCmdResetQueryPool(to, cut.queries, static_cast<std::uint32_t>(2 * span), 2);
                stamp(to, 0);
            }
            encode(to, commands[cut.pieces[p].command], cut.pieces[p]);
            if (stamped && p + 1 == spans[span].last) {
                stamp(to, 1);
                ++span;
            }
        }
        SPLAT_TRY(device->check(vk.vkEndCommandBuffer(to), "vkEndCommandBuffer"));
    }
    return {};
}

void CommandList::Objects::encode(VkCommandBuffer to, const Command& command, const Piece& piece) {
    const VolkDeviceTable& vk = device->vk;
    switch (command.kind) {
        case CommandKind::kDispatch:
            encode_dispatch(to, command, piece);
            break;
        case CommandKind::kFill: {
            const BufferView view = transferred(command.accesses[0].view, piece);
            vk.vkCmdFillBuffer(to, view.buffer, view.offset, view.bytes, command.fill_word);
            break;
        }
        case CommandKind::kCopy: {
            const BufferView from = transferred(command.accesses[0].view, piece);
            const BufferView target = transferred(command.accesses[1].view, piece);
            const VkBufferCopy region{from.offset, target.offset, from.bytes};
            vk.vkCmdCopyBuffer(to, from.buffer, target.buffer, 1, &region);
            break;
        }
        case CommandKind::kBarrier:
        case CommandKind::kToHost: {
            VkMemoryBarrier barrier{};
            barrier.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
            barrier.srcAccessMask = writes_of(command.from);
            barrier.dstAccessMask = reads_of(command.to) | writes_of(command.to);
            vk.vkCmdPipelineBarrier(to, pipeline_stages(command.from), pipeline_stages(command.to),
                                    0, 1, &barrier, 0, nullptr, 0, nullptr);
            break;
        }
    }
}

void CommandList::Objects::deal(const PieceSpan& span, double milliseconds,
                                std::vector<double>& command_ms) const {
    double sum = 0;
    for (std::size_t i = span.first; i < span.last; ++i) sum += now.pieces[i].seconds;
    for (std::size_t i = span.first; i < span.last; ++i)
        command_ms[now.pieces[i].command] += milliseconds * now.pieces[i].seconds / sum;
}

void CommandList::Objects::encode_dispatch(VkCommandBuffer to, const Command& command,
                                           const Piece& piece) {
    const VolkDeviceTable& vk = device->vk;
    const Pipeline& pipeline = *command.pipeline;
    vk.vkCmdBindPipeline(to, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.job.pipeline);
    vk.vkCmdBindDescriptorSets(to, VK_PIPELINE_BIND_POINT_COMPUTE, pipeline.layout, 0, 1,
                               &command.set, 0, nullptr);
    if (command.push.bytes() > 0)
        vk.vkCmdPushConstants(to, pipeline.layout, VK_SHADER_STAGE_COMPUTE_BIT, 0,
                              command.push.bytes(), command.push.data());
    const auto& [x, y, z] = piece.groups;
    if (piece.base == Groups{0, 0, 0}) {
        // Validation layers up to 1.3.239 at least check this call, but not vkCmdDispatchBase.
        vk.vkCmdDispatch(to, x, y, z);
    } else {
        vk.vkCmdDispatchBase(to, piece.base[0], piece.base[1], piece.base[2], x, y, z);
    }
}

Result<CommandList> CommandList::create(Context& context, std::vector<Command> commands) {
    CommandList list;
    if (commands.empty()) return list;
    Device& device = context.device();
    SPLAT_TRY(device.alive());
    list.objects_ = std::make_shared<Objects>();
    Objects& objects = *list.objects_;
    objects.device = &device;
    objects.pipelines = &context.pipelines();
    objects.commands = std::move(commands);
    SPLAT_TRY(objects.make_sets());
    objects.now = objects.cut(0);
#ifndef NDEBUG
    SPLAT_TRY(objects.check_estimates());
#endif
    objects.changes = device.pace.changes();
    SPLAT_TRY(objects.make_command_buffers(objects.now, 0));
    objects.alone = device.info().kind == DeviceKind::kCpu && !context.profiles_levels();
    objects.timed = context.profile() != nullptr && device.info().limits.timestamp_ns > 0;
    if (objects.timed) SPLAT_TRY(objects.make_queries(objects.now));
    return list;
}

void CommandList::set_whole_from(std::size_t first) {
    SPLAT_ASSERT(objects_ != nullptr);
    objects_->whole_from = first;
}

const std::vector<Command>& CommandList::commands() const {
    static const std::vector<Command> none;
    return objects_ == nullptr ? none : objects_->commands;
}

const std::vector<Piece>& CommandList::pieces() const {
    static const std::vector<Piece> none;
    return objects_ == nullptr ? none : objects_->now.pieces;
}

std::size_t CommandList::submit_count() const {
    return objects_ == nullptr ? 0 : objects_->now.segments.size();
}

}  // namespace splat::vk
