#include "raster/radix_sort.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "ops/launch.h"
#include "params/radix_sort_params.h"

namespace splat::raster {
namespace {

/// Shape of the sort on a device. A digit's counters, one column per lane or on GPUs per subgroup,
/// fit 32 KiB of shared memory. On CPU devices one subgroup per workgroup and 8 bits; a lane's chunk
/// is longer than its 256 counters, or they would take most of the time.
struct Plan {
    std::uint32_t group;
    std::uint32_t digit_bits;
    std::uint32_t passes;
    std::uint32_t lanes;  ///< or workgroups, with the kernels for GPUs
    std::uint32_t groups;
};

Plan plan_for(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const vk::Kernels kernels = recorder.kernels();
    const bool plain = kernels == vk::Kernels::kPlain;
    const bool gpu = kernels == vk::Kernels::kGpu;
    const std::uint32_t most_bits = plain ? 4 : 8;
    const std::uint32_t bits = std::max(desc.key_bits, 1U);
    Plan plan{};
    plan.group = ops::workgroup_size(recorder.device(), gpu ? 128 : plain ? 32 : 8);
    plan.passes = (bits + most_bits - 1) / most_bits;
    plan.digit_bits = (bits + plan.passes - 1) / plan.passes;
    const std::uint32_t chunk = gpu ? 4096 : plain ? 128 : 1024;
    const std::uint32_t wanted = std::bit_ceil(std::max(desc.capacity / chunk, 1U));
    const auto least =  // chunks within the turns that a loop may take
        std::bit_ceil(static_cast<std::uint32_t>(ceil_div(desc.capacity, ops::kMaxTurns)));
    plan.lanes = std::max(std::clamp(wanted, gpu ? 1U : 32U, gpu || plain ? 4096U : 256U), least);
    plan.groups = gpu ? plan.lanes : plan.lanes / plan.group;
    return plan;
}

}  // namespace

std::uint64_t radix_sort_table_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const Plan plan = plan_for(recorder, desc);
    return std::uint64_t{4} * plan.lanes << plan.digit_bits;
}

std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    return plan_for(recorder, desc).passes % 2;
}

Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views) {
    const Plan plan = plan_for(recorder, desc);
    const vk::Kernels kernels = recorder.kernels();
    const double entries = desc.capacity;
    const double table = static_cast<double>(plan.lanes << plan.digit_bits) * 4;
    for (std::uint32_t pass = 0; pass < plan.passes; ++pass) {
        const params::RadixSortParams params{desc.capacity, plan.lanes, pass * plan.digit_bits};
        const std::uint32_t in = pass % 2;
        const bool positions = desc.positions && pass == 0;
        const vk::SpecConstant group = {ops::kWorkgroupSizeId, plan.group};
        const vk::SpecConstant digit = {10, plan.digit_bits};
        const vk::SpecConstant first = {13, pass == 0 ? 1U : 0U};
        const vk::BufferView& count = pass == 0 ? views.entries : views.kept;
        SPLAT_TRY(recorder.dispatch({
            .op = "radix_sort",
            .shader = ops::pick(kernels, "radix_sort_upsweep", "radix_sort_upsweep_cpu",
                                "radix_sort_upsweep_gpu"),
            .constants = {group, digit, first},
            .push = params,
            .accesses = {vk::read(views.keys[in]), vk::read(count), vk::write(views.table)},
            .groups = {plan.groups, 1, 1},
            .work = {.flops = entries, .bytes = 4 * entries + table},
        }));
        SPLAT_TRY(recorder.dispatch({
            .op = "radix_sort",
            .shader = "radix_sort_spine",
            .constants = {group, digit},
            .push = params,
            .accesses = {vk::read_write(views.table), vk::write(views.totals)},
            .groups = {((1U << plan.digit_bits) + plan.group - 1) / plan.group, 1, 1},
            .work = {.flops = table / 4, .bytes = 2 * table},
        }));
        SPLAT_TRY(recorder.dispatch({
            .op = "radix_sort",
            .shader = ops::pick(kernels, "radix_sort_downsweep", "radix_sort_downsweep_cpu",
                                "radix_sort_downsweep_gpu"),
            .constants =
                {group, digit, {11, positions ? 1U : 0U}, {12, desc.second ? 1U : 0U}, first},
            .push = params,
            .accesses = {vk::read(views.keys[in]),
                         vk::read(positions ? views.keys[in] : views.values[in]),
                         vk::read(views.seconds[in]), vk::read(count), vk::read(views.table),
                         vk::read(views.totals), vk::write(views.keys[1 - in]),
                         vk::write(views.values[1 - in]), vk::write(views.seconds[1 - in]),
                         vk::write(pass == 0 ? views.kept : views.scratch)},
            .groups = {plan.groups, 1, 1},
            .work = {.flops = entries, .bytes = (desc.second ? 24 : 16) * entries + table},
        }));
    }
    return {};
}

}  // namespace splat::raster
