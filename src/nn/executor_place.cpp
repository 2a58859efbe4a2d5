// Memory for the tensors of a plan: as much as lists in levels may take, or the least.
#include "core/environment.h"
#include "core/log.h"
#include "nn/executor_plan.h"

namespace splat::nn {
namespace {

/// Arenas stay well below the largest allocation of drivers (2 GiB on lavapipe).
constexpr std::uint64_t kArenaBytes = std::uint64_t{512} << 20;

/// Append a buffer for each arena. An error leaves none of them.
Status allocate(vk::Memory& memory, const MemoryPlan& plan, const char* label,
                std::vector<vk::Buffer>& buffers) {
    const std::size_t first = buffers.size();
    for (const std::uint64_t bytes : plan.arena_bytes) {
        auto made = memory.allocate(bytes, vk::MemoryKind::kDevice, label);
        if (!made.ok()) {
            buffers.resize(first);
            return made.status();
        }
        buffers.push_back(std::move(made.value()));
    }
    return {};
}

Result<Spread> spread_of(const ExecutorDesc& desc) {
    constexpr const char* kVariable = "SPLAT_LEVELS_MEMORY";
    Spread spread = desc.spread;
    if (!environment(kVariable)) return spread;
    SPLAT_ASSIGN(spread.part, environment_positive(kVariable, spread.part));
    spread.bytes = 0;
    return spread;
}

}  // namespace

Status ExecutorPlan::place(vk::Context& context, Home home, std::vector<vk::Buffer>& buffers,
                           ExecutorMemory& memory) {
    std::vector<std::size_t> members;
    std::vector<Lifetime> apart;      // where lists run in levels
    std::vector<Lifetime> lifetimes;  // in the smaller form
    std::vector<std::uint32_t> earliest;
    for (std::size_t i = 0; i < tensors_.size(); ++i) {
        const Tensor& tensor = tensors_[i];
        if (tensor.home != home) continue;
        members.push_back(i);
        apart.push_back(tensor.life);
        lifetimes.push_back(tensor.life);
        if (tensor.least > 0) lifetimes.back().bytes = tensor.least;
        earliest.push_back(tensor.earliest);
    }
    const vk::DeviceInfo& device = context.device().info();
    const std::uint64_t alignment = device.limits.offset_alignment;
    const char* label = home == Home::kKept ? "prepared weights" : desc_.label;
    const std::size_t first = buffers.size();
    MemoryPlan plan = plan_memory(lifetimes, alignment, desc_.separate ? 0 : kArenaBytes);
    std::optional<MemoryPlan> wide;
    if (device.features.levels && home == Home::kArenas && !desc_.separate) {
        SPLAT_ASSIGN(const Spread spread, spread_of(desc_));
        wide = plan_spread(apart, earliest, spread.ticks, spread.most(plan.bytes()), alignment,
                           kArenaBytes);
    }
    Status allocated = allocate(context.memory(), wide ? *wide : plan, label, buffers);
    if (wide && allocated.code() == Code::kOutOfDeviceMemory) {
        log(LogLevel::kInfo, "less runs side by side, in less memory: " + allocated.message());
        wide.reset();
        allocated = allocate(context.memory(), plan, label, buffers);
    }
    SPLAT_TRY(allocated);
    if (wide) {
        plan = std::move(*wide);
        lifetimes = std::move(apart);
    }
    memory.bound += peak_bytes(lifetimes);
    memory.arenas += plan.bytes();
    for (std::size_t i = 0; i < members.size(); ++i) {
        vk::BufferView& view = tensors_[members[i]].view;
        view = buffers[first + plan.placements[i].arena].range();
        view.offset += plan.placements[i].offset;
        view.bytes = vk::quad_bytes((lifetimes[i].bytes + 3) / 4);
    }
    if (home == Home::kKept) {
        memory.prepared = kept_bytes_;
        kept_placed_ = true;
    }
    return {};
}

}  // namespace splat::nn
