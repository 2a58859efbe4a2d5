#include "vk/recorder.h"

#include <algorithm>
#include <utility>

#include "core/checked_math.h"
#include "vk/context.h"
#include "vk/hazard.h"
#include "vk/levels.h"
#include "vk/shaders.h"

namespace splat::vk {
namespace {

/// Cautious rates to begin with, in operations and bytes per second: the slowest kernels of each class reached a few
/// times as much. What a device does is measured, see pace.h.
struct Rates {
    double flops;
    double bytes;
};

Rates rates(const DeviceInfo& info, Kernels kernels) {
    const bool plain = kernels == Kernels::kPlain;
    if (info.kind != DeviceKind::kCpu) return plain ? Rates{2e10, 5e9} : Rates{2e11, 2e10};
    return plain ? Rates{5e8, 5e8} : Rates{1e10, 1e9};
}

std::uint64_t binding_bytes(const DeviceLimits& limits, DescriptorType type) {
    switch (type) {
        case DescriptorType::kFloatTexelBuffer:
        case DescriptorType::kIntQuadTexelBuffer:
            return limits.max_texel_elements * 16;
        case DescriptorType::kUintTexelBuffer:
            return limits.max_texel_elements * 4;
        default:
            return limits.max_storage_buffer_bytes;
    }
}

Groups transfer_groups(const BufferView& view) {
    const std::uint64_t pieces = ceil_div(view.bytes, kTransferPiece);
    return {static_cast<std::uint32_t>(std::max<std::uint64_t>(pieces, 1)), 1, 1};
}

bool overlaps_partly(const BufferView& a, const BufferView& b) {
    return a.overlaps(b) && !a.same_range(b);
}

Status check_declarations(const Command& command, bool may_alias) {
    const ShaderInterface& interface = command.pipeline->interface;
    if (command.accesses.size() != interface.bindings.size())
        return error(Code::kInternal, "%s: %zu accesses declared, shader %s has %zu bindings",
                     command.op.c_str(), command.accesses.size(), command.shader,
                     interface.bindings.size());
    if (command.push.bytes() != interface.push_bytes)
        return error(Code::kInternal, "%s: %u bytes of push constants, shader %s has %u",
                     command.op.c_str(), command.push.bytes(), command.shader,
                     interface.push_bytes);
    for (std::size_t i = 0; i < command.accesses.size(); ++i) {
        const ShaderBinding& binding = interface.bindings[i];
        const Use use = command.accesses[i].use;
        if (binding.writes != writes(use) || binding.reads != (use != Use::kWrite))
            return error(
                Code::kInternal,
                "%s: binding %zu of shader %s is declared differently there (reads %d, writes %d)",
                command.op.c_str(), i, command.shader, binding.reads, binding.writes);
    }
    for (std::size_t i = 0; i < command.accesses.size(); ++i)
        for (std::size_t j = 0; j < i; ++j) {
            const Access& a = command.accesses[i];
            const Access& b = command.accesses[j];
            if (!a.view.overlaps(b.view) || (!writes(a.use) && !writes(b.use))) continue;
            if (!may_alias || overlaps_partly(a.view, b.view))
                return error(Code::kInternal,
                             "%s: bindings %zu and %zu of shader %s alias and one is written",
                             command.op.c_str(), j, i, command.shader);
        }
    return {};
}

}  // namespace

const ShaderModule* module_for(std::string_view stem, Kernels kernels) {
    const ShaderVariants variants = shader_variants(stem);
    const ShaderModule* module = nullptr;
    if (kernels == Kernels::kCpu) module = variants.cpu;
    if (kernels == Kernels::kGpu) module = variants.gpu;
    return module != nullptr ? module : variants.plain;
}

double estimated_seconds(const DeviceInfo& info, Kernels kernels, const Work& work) {
    constexpr double kLeastSeconds = 1e-6;  // a dispatch that does next to nothing
    const Rates rate = rates(info, kernels);
    return kLeastSeconds + std::max(work.flops / rate.flops, work.bytes / rate.bytes);
}

const DeviceInfo& Recorder::device() const {
    return context_.device().info();
}
Kernels Recorder::kernels(Family family) const {
    return context_.device().kernels(family);
}

Status Recorder::check_limits(const Command& command) const {
    const ShaderInterface& interface = command.pipeline->interface;
    const DeviceLimits& limits = device().limits;
    for (std::size_t i = 0; i < command.accesses.size(); ++i) {
        const BufferView& view = command.accesses[i].view;
        if (view.buffer == VK_NULL_HANDLE)
            return error(Code::kInternal, "%s: binding %zu of shader %s has no buffer",
                         command.op.c_str(), i, command.shader);
        SPLAT_ASSERT(view.bytes > 0 && view.offset % limits.offset_alignment == 0);
        const std::uint64_t most = binding_bytes(limits, interface.bindings[i].type);
        if (view.bytes > most)
            return unsupported(
                "%s: a tensor %s of %llu bytes, but one binding takes at most %llu; split it",
                command.op.c_str(), view.shape.text().c_str(), llu(view.bytes), llu(most));
    }
    for (std::size_t axis = 0; axis < 3; ++axis)
        if (command.groups[axis] == 0 || command.groups[axis] > limits.max_groups[axis])
            return unsupported("%s: %u workgroups on axis %zu, expected 1 to %u",
                               command.op.c_str(), command.groups[axis], axis,
                               limits.max_groups[axis]);
    return {};
}

Status Recorder::dispatch(const Dispatch& dispatch) {
    const Kernels used = dispatch.kernels.value_or(kernels());
    const ShaderModule* module = module_for(dispatch.shader, used);
    if (module == nullptr)
        return error(Code::kInternal, "%s: no shader '%s' is built in for %s kernels", dispatch.op,
                     dispatch.shader, kernels_name(used));
    Command command;
    command.kind = CommandKind::kDispatch;
    command.op = dispatch.op;
    command.shader = module->name;
    command.accesses = dispatch.accesses;
    command.push = dispatch.push;
    command.groups = dispatch.groups;
    command.work = dispatch.work;
    if (!(command.work.flops > 0 || command.work.bytes > 0))
        return error(Code::kInternal, "%s: no estimate of the work of shader %s", dispatch.op,
                     module->name);
    if (dispatch.most_group.flops > 0)
        command.group_seconds = estimated_seconds(device(), used, dispatch.most_group);
    SPLAT_ASSIGN(command.pipeline, context_.pipelines().get(module->name, dispatch.constants));
    SPLAT_TRY(check_declarations(command, dispatch.may_alias));
    SPLAT_TRY(check_limits(command));
    add(std::move(command), used);
    return {};
}

Status Recorder::fill(const BufferView& view, std::uint32_t word) {
    SPLAT_ASSERT(view.offset % 4 == 0 && view.bytes % 4 == 0);
    Command command;
    command.kind = CommandKind::kFill;
    command.op = "fill";
    command.accesses = {write(view)};
    command.fill_word = word;
    command.groups = transfer_groups(view);
    command.work.bytes = static_cast<double>(view.bytes);
    add(std::move(command), kernels());
    return {};
}

Status Recorder::copy(const BufferView& from, const BufferView& to) {
    SPLAT_ASSERT(from.bytes == to.bytes);
    if (from.buffer == VK_NULL_HANDLE || to.buffer == VK_NULL_HANDLE)
        return error(Code::kInternal, "copy: source or destination has no buffer");
    if (from.overlaps(to)) return error(Code::kInternal, "copy: source and destination overlap");
    Command command;
    command.kind = CommandKind::kCopy;
    command.op = "copy";
    command.accesses = {read(from), write(to)};
    command.groups = transfer_groups(to);
    command.work.bytes = 2.0 * static_cast<double>(from.bytes);
    add(std::move(command), kernels());
    return {};
}

void Recorder::add(Command command, Kernels kernels) {
    const bool dispatches = command.kind == CommandKind::kDispatch;
    command.seconds = estimated_seconds(device(), kernels, command.work);
    command.pace = &context_.device().pace.of(dispatches ? command.shader : command.op);
    if (dispatches && bounds) command.pace->bound = true;
    command.recorded = commands_.size();
    commands_.push_back(std::move(command));
}

Result<CommandList> Recorder::finish() {
    std::vector<Command> commands = std::exchange(commands_, {});
    std::vector<std::uint32_t> levels(commands.size(), 1);
    if (!omit_barriers) levels = dependency_levels(commands, !device().features.levels);
    commands = in_levels(std::move(commands), levels);
#ifndef NDEBUG
    if (!omit_barriers) SPLAT_TRY(check_hazards(commands));
#endif
    return CommandList::create(context_, std::move(commands));
}

}  // namespace splat::vk
