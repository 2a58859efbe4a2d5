#include "raster/radix_sort.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "params/radix_sort_params.h"
#include "vk/launch.h"

namespace splat::raster {
namespace {

/// Shape of the sort on a device. A lane has a counter for each value of a digit; on GPUs they are
/// per subgroup and fit 32 KiB of shared memory. On CPU devices one subgroup per workgroup and up to
/// 9 bits: depths within a factor of 65536, whose bits differ in 27, take three passes (8 bits: within one
/// of 4), and 512 tiles take one. A lane's chunk is longer than its 512 counters, or they would take most
/// of the time.
struct Plan {
    std::uint32_t group;
    std::uint32_t digit_bits;
    std::uint32_t passes;
    std::uint32_t lanes;  ///< or workgroups: on GPUs, and on CPUs where entries are moved
    std::uint32_t least;  ///< of them for few entries
    std::uint32_t chunk;  ///< entries for each of them
    std::uint32_t groups;
    bool ranged;  ///< keys of all bits: digits of the bits by which they differ
};

/// How a set of kernels shares entries: lanes (or workgroups) for few and for many of them, entries
/// that each further one is for, and the most that one can have: the turns of its loop, the 16 bits of
/// a rank. On CPU devices one workgroup sums the counts, longer for more chunks; 8 chunks are one workgroup
/// of counting, so 128 give work to 16 threads.
struct Sharing {
    std::uint32_t least, most, chunk, longest;
};

Sharing sharing_of(vk::Kernels kernels) {
    if (kernels == vk::Kernels::kCpu) return {16, 128, 4096, 1U << 16};
    if (kernels == vk::Kernels::kGpu) return {1, 4096, 4096, vk::kMaxTurns};
    return {32, 4096, 128, vk::kMaxTurns};
}

Plan plan_for(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const vk::Kernels kernels = recorder.kernels();
    const bool plain = kernels == vk::Kernels::kPlain;
    const bool gpu = kernels == vk::Kernels::kGpu;
    const Sharing sharing = sharing_of(kernels);
    const std::uint32_t most_bits = plain ? 4 : gpu ? 8 : 9;
    const std::uint32_t bits = std::max(desc.key_bits, 2U);  // bins are read in quads
    Plan plan{};
    plan.group = vk::workgroup_size(recorder.device(), gpu ? 128 : plain ? 32 : 8);
    plan.passes = (bits + most_bits - 1) / most_bits;
    plan.ranged = !gpu && bits == 32;
    plan.digit_bits = plan.ranged ? most_bits : (bits + plan.passes - 1) / plan.passes;
    plan.chunk = sharing.chunk;
    const std::uint32_t wanted = std::bit_ceil(std::max(desc.capacity / plan.chunk, 1U));
    const auto needed =
        std::bit_ceil(static_cast<std::uint32_t>(ceil_div(desc.capacity, sharing.longest)));
    plan.lanes = std::max(std::clamp(wanted, sharing.least, sharing.most), needed);
    plan.least = gpu ? plan.lanes : std::max(sharing.least, needed);
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
        .shader = "radix_sort_range",
        .constants = {{params::kWorkgroupSizeId, plan.group}},
        .push = params_of(plan, desc, 0),
        .accesses = {vk::read(views.input), vk::read(views.count), vk::read_write(views.range)},
        .groups = {plan.groups, 1, 1},
        .work = {.flops = double{2} * desc.capacity, .bytes = double{8} * desc.capacity},
    });
}

/// One digit. Which pass is the first is known on the device if digits are by the range of the keys, so
/// that the kernels see the input, too.
struct Pass {
    params::RadixSortParams params;
    std::vector<vk::SpecConstant> constants;
    vk::BufferView input, entries, entries_out, seconds, seconds_out;
    double count = 0;  ///< entries
    double table = 0;  ///< bytes
};

Pass pass_of(const Plan& plan, const RadixSortDesc& desc, const RadixSortViews& views,
             std::uint32_t pass) {
    const vk::BufferView& entries = pass == 0 ? views.input : views.sides[(pass - 1) % 2];
    return {.params = params_of(plan, desc, pass),
            .constants = {{params::kWorkgroupSizeId, plan.group},
                          {params::kRadixSortBitsId, plan.digit_bits},
                          {params::kRadixSortSecondId, desc.second ? 1U : 0U},
                          {params::kRadixSortRangedId, plan.ranged ? 1U : 0U}},
            .input = plan.ranged ? views.input : entries,
            .entries = entries,
            .entries_out = views.sides[pass % 2],
            .seconds = views.seconds[1 - pass % 2],
            .seconds_out = views.seconds[pass % 2],
            .count = double{1} * desc.capacity,
            .table = double{4} * (plan.lanes << plan.digit_bits)};
}

Status count_digits(vk::Recorder& recorder, const Plan& plan, const RadixSortViews& views,
                    const Pass& pass) {
    const vk::Kernels kernels = recorder.kernels();
    std::vector<vk::Access> accesses = {vk::read(pass.input), vk::read(pass.entries),
                                        vk::read(views.count), vk::read(views.kept),
                                        vk::write(views.table)};
    if (kernels != vk::Kernels::kGpu) accesses.push_back(vk::read(views.range));
    if (kernels == vk::Kernels::kCpu) accesses.push_back(vk::write(views.ranks));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_upsweep",
        .constants = pass.constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {plan.groups, 1, 1},
        .work = {.flops = pass.count, .bytes = 8 * pass.count + pass.table},
    });
}

Status sum_counts(vk::Recorder& recorder, const Plan& plan, const RadixSortViews& views,
                  const Pass& pass) {
    const bool cpu = recorder.kernels() == vk::Kernels::kCpu;
    std::vector<vk::Access> accesses = {vk::read_write(views.table), vk::write(views.totals),
                                        vk::read(views.count), vk::read(views.kept),
                                        vk::read(views.range)};
    if (cpu)
        accesses = {vk::read(views.table), vk::read(views.count), vk::read(views.range),
                    vk::write(views.places), vk::read_write(views.kept)};
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_spine",
        .constants = pass.constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {cpu ? 1 : ((1U << plan.digit_bits) + plan.group - 1) / plan.group, 1, 1},
        .work = {.flops = pass.table / 4, .bytes = 2 * pass.table},
    });
}

Status move_entries(vk::Recorder& recorder, const Plan& plan, const RadixSortViews& views,
                    const Pass& pass, bool second) {
    const vk::Kernels kernels = recorder.kernels();
    const bool cpu = kernels == vk::Kernels::kCpu;
    std::vector<vk::Access> accesses = {vk::read(pass.input),
                                        vk::read(pass.entries),
                                        vk::read(views.count),
                                        cpu ? vk::read(views.kept) : vk::read_write(views.kept),
                                        vk::read(cpu ? views.places : views.table),
                                        vk::read(cpu ? views.ranks : views.totals),
                                        vk::read(pass.seconds),
                                        vk::write(pass.entries_out),
                                        vk::write(pass.seconds_out)};
    if (kernels != vk::Kernels::kGpu) accesses.push_back(vk::read(views.range));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_downsweep",
        .constants = pass.constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {cpu ? plan.lanes : plan.groups, 1, 1},
        .work = {.flops = pass.count, .bytes = (second ? 24 : 16) * pass.count + pass.table},
    });
}

}  // namespace

std::uint64_t radix_sort_table_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const Plan plan = plan_for(recorder, desc);
    return std::uint64_t{4} * plan.lanes << plan.digit_bits;
}

std::uint64_t radix_sort_rank_bytes(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    // 16 bits each, written for four entries at a time.
    return recorder.kernels() == vk::Kernels::kCpu ? ceil_div(std::uint64_t{desc.capacity}, 4) * 8
                                                   : 16;
}

std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    return (plan_for(recorder, desc).passes + 1) % 2;
}

Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views) {
    SPLAT_ASSERT(desc.capacity >= 1 && desc.capacity <= kMaxSorted);
    const Plan plan = plan_for(recorder, desc);
    // The first pass that works is known on the device alone, and with it the second values' side.
    SPLAT_ASSERT(!plan.ranged || !desc.second);
    if (plan.ranged) SPLAT_TRY(key_range(recorder, plan, desc, views));
    for (std::uint32_t index = 0; index < plan.passes; ++index) {
        const Pass pass = pass_of(plan, desc, views, index);
        SPLAT_TRY(count_digits(recorder, plan, views, pass));
        SPLAT_TRY(sum_counts(recorder, plan, views, pass));
        SPLAT_TRY(move_entries(recorder, plan, views, pass, desc.second));
    }
    return {};
}

}  // namespace splat::raster
