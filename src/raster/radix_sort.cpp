#include "raster/radix_sort.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "ops/launch.h"
#include "params/radix_sort_params.h"

namespace splat::raster {
namespace {

/// Shape of the sort on a device. A lane has a counter for each value of a digit; on GPUs they are
/// per subgroup and fit 32 KiB of shared memory. On CPU devices one subgroup per workgroup and up to
/// 8 bits: depths within a factor of 4 take three passes. A lane's chunk is longer than its 256
/// counters, or they would take most of the time.
struct Plan {
    std::uint32_t group;
    std::uint32_t digit_bits;
    std::uint32_t passes;
    std::uint32_t lanes;  ///< or workgroups, with the kernels for GPUs
    std::uint32_t least;  ///< of them for few entries
    std::uint32_t chunk;  ///< entries for each of them
    std::uint32_t groups;
    bool ranged;  ///< keys of all bits: digits of the bits by which they differ
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
    plan.ranged = !gpu && bits == 32;
    plan.digit_bits = plan.ranged ? most_bits : (bits + plan.passes - 1) / plan.passes;
    plan.chunk = gpu ? 4096 : plain ? 128 : 1024;
    const std::uint32_t wanted = std::bit_ceil(std::max(desc.capacity / plan.chunk, 1U));
    const auto least =  // chunks within the turns that a loop may take
        std::bit_ceil(static_cast<std::uint32_t>(ceil_div(desc.capacity, ops::kMaxTurns)));
    plan.lanes = std::max(std::clamp(wanted,
                                     gpu     ? 1U
                                     : plain ? 32U
                                             : 16U,
                                     gpu || plain ? 4096U : 256U),
                          least);
    plan.least = gpu ? plan.lanes : std::max(gpu || plain ? 32U : 16U, least);
    plan.groups = gpu ? plan.lanes : plan.lanes / plan.group;
    return plan;
}

params::RadixSortParams params_of(const Plan& plan, const RadixSortDesc& desc, std::uint32_t pass) {
    params::RadixSortParams params{};
    params.capacity = desc.capacity;
    params.lanes = plan.lanes;
    params.least = plan.least;
    params.chunk = plan.chunk;
    params.pass = pass;
    params.passes = plan.passes;
    return params;
}

Status key_range(vk::Recorder& recorder, const Plan& plan, const RadixSortDesc& desc,
                 const RadixSortViews& views) {
    SPLAT_TRY(recorder.fill(views.range, 0xFFFFFFFFU));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = ops::pick(recorder.kernels(), "radix_sort_range", "radix_sort_range_cpu",
                            "radix_sort_range"),
        .constants = {{ops::kWorkgroupSizeId, plan.group}},
        .push = params_of(plan, desc, 0),
        .accesses = {vk::read(views.input), vk::read(views.count), vk::read_write(views.range)},
        .groups = {plan.groups, 1, 1},
        .work = {.flops = double{2} * desc.capacity, .bytes = double{8} * desc.capacity},
    });
}

/// Sort by one digit: count, sum, move. Which pass is the first is known on the device if digits are
/// by the range of the keys.
Status sort_pass(vk::Recorder& recorder, const Plan& plan, const RadixSortDesc& desc,
                 const RadixSortViews& views, std::uint32_t pass) {
    const vk::Kernels kernels = recorder.kernels();
    const double entries = desc.capacity;
    const double table = static_cast<double>(plan.lanes << plan.digit_bits) * 4;
    const params::RadixSortParams params = params_of(plan, desc, pass);
    const vk::BufferView& entries_in = pass == 0 ? views.input : views.sides[(pass - 1) % 2];
    const vk::SpecConstant group = {ops::kWorkgroupSizeId, plan.group};
    const vk::SpecConstant digit = {10, plan.digit_bits};
    const vk::SpecConstant ranged = {15, plan.ranged ? 1U : 0U};
    std::vector<vk::SpecConstant> up = {group, digit};
    std::vector<vk::SpecConstant> down = {group, digit, {12, desc.second ? 1U : 0U}};
    const vk::BufferView& input = plan.ranged ? views.input : entries_in;
    std::vector<vk::Access> counted = {vk::read(input), vk::read(entries_in), vk::read(views.count),
                                       vk::read(views.kept), vk::write(views.table)};
    std::vector<vk::Access> moved = {vk::read(input),
                                     vk::read(entries_in),
                                     vk::read(views.count),
                                     vk::read_write(views.kept),
                                     vk::read(views.table),
                                     vk::read(views.totals),
                                     vk::read(views.seconds[1 - pass % 2]),
                                     vk::write(views.sides[pass % 2]),
                                     vk::write(views.seconds[pass % 2])};
    if (kernels != vk::Kernels::kGpu) {
        up.push_back(ranged);
        down.push_back(ranged);
        counted.push_back(vk::read(views.range));
        moved.push_back(vk::read(views.range));
    }
    SPLAT_TRY(recorder.dispatch({
        .op = "radix_sort",
        .shader = ops::pick(kernels, "radix_sort_upsweep", "radix_sort_upsweep_cpu",
                            "radix_sort_upsweep_gpu"),
        .constants = up,
        .push = params,
        .accesses = counted,
        .groups = {plan.groups, 1, 1},
        .work = {.flops = entries, .bytes = 8 * entries + table},
    }));
    SPLAT_TRY(recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_spine",
        .constants = {group, digit, ranged},
        .push = params,
        .accesses = {vk::read_write(views.table), vk::write(views.totals), vk::read(views.count),
                     vk::read(views.kept), vk::read(views.range)},
        .groups = {((1U << plan.digit_bits) + plan.group - 1) / plan.group, 1, 1},
        .work = {.flops = table / 4, .bytes = 2 * table},
    }));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = ops::pick(kernels, "radix_sort_downsweep", "radix_sort_downsweep_cpu",
                            "radix_sort_downsweep_gpu"),
        .constants = down,
        .push = params,
        .accesses = moved,
        .groups = {plan.groups, 1, 1},
        .work = {.flops = entries, .bytes = (desc.second ? 24 : 16) * entries + table},
    });
}

}  // namespace

std::uint64_t radix_sort_table_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const Plan plan = plan_for(recorder, desc);
    return std::uint64_t{4} * plan.lanes << plan.digit_bits;
}

std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    return (plan_for(recorder, desc).passes + 1) % 2;
}

Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views) {
    const Plan plan = plan_for(recorder, desc);
    // The first pass that works is known on the device alone, and with it the second values' side.
    SPLAT_ASSERT(!plan.ranged || !desc.second);
    if (plan.ranged) SPLAT_TRY(key_range(recorder, plan, desc, views));
    for (std::uint32_t pass = 0; pass < plan.passes; ++pass)
        SPLAT_TRY(sort_pass(recorder, plan, desc, views, pass));
    return {};
}

}  // namespace splat::raster
