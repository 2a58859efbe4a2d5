#include "raster/radix_sort.h"

#include <algorithm>
#include <bit>

#include "core/checked_math.h"
#include "params/radix_sort_params.h"
#include "vk/launch.h"

namespace splat::raster {
namespace {

/// Values of the longest digit with kernels that keep totals.
constexpr std::uint32_t kRadixBins = 256;

/// Shape of the sort on a device. Each lane has one counter per value of a digit; on GPUs each
/// subgroup has, in 32 KiB of shared memory. On CPU devices a workgroup is one subgroup and digits
/// have up to 9 bits: depths within a factor of 65536 differ in 27 bits and take three passes (with
/// 8 bits only a factor of 4 would), and 512 tiles take one. Chunks are longer than 512, or the
/// counters would take most of the time.
struct Plan {
    std::uint32_t group;
    std::uint32_t digit_bits;
    std::uint32_t passes;
    std::uint32_t lanes;  ///< lanes, or workgroups: on GPUs, and on CPUs when entries are moved
    std::uint32_t least;  ///< lanes that take part even if there are few entries
    std::uint32_t chunk;  ///< entries per lane
    std::uint32_t groups;
    std::uint32_t subgroups;  ///< most in a workgroup; kernels for GPUs only
    bool ranged;              ///< sort by the bits in which the keys differ; keys of 32 bits
};

/// How kernels share entries among lanes (or workgroups): the least and the most lanes, the entries
/// per lane in between, and the most that one lane can take (turns of its loop, 16 bits of a rank).
/// On CPU devices one workgroup sums the counts of all chunks, so fewer are faster; 128 chunks keep
/// 16 threads busy, as a workgroup counts 8. On GPUs a workgroup sums those of a digit in quads, so there are at least
/// four, and short chunks keep many of them busy.
struct Sharing {
    std::uint32_t least, most, chunk, longest;
};

Sharing sharing_of(vk::Kernels kernels) {
    if (kernels == vk::Kernels::kCpu) return {16, 128, 4096, 1U << 16};
    if (kernels == vk::Kernels::kGpu) return {4, 4096, 1024, vk::kMaxTurns};
    return {32, 4096, 128, vk::kMaxTurns};
}

Plan plan_for(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    const vk::Kernels kernels = recorder.kernels(vk::Family::kSort);
    const bool plain = kernels == vk::Kernels::kPlain;
    const bool gpu = kernels == vk::Kernels::kGpu;
    const Sharing sharing = sharing_of(kernels);
    const std::uint32_t most_bits = plain ? 4 : gpu ? 8 : 9;
    const std::uint32_t bits = std::max(desc.key_bits, 2U);  // bins are read in quads
    Plan plan{};
    plan.group = vk::workgroup_size(recorder.device(), gpu ? 128 : plain ? 32 : 8);
    plan.passes = (bits + most_bits - 1) / most_bits;
    plan.ranged = bits == 32;
    plan.digit_bits = plan.ranged ? most_bits : (bits + plan.passes - 1) / plan.passes;
    plan.chunk = sharing.chunk;
    const std::uint32_t wanted = std::bit_ceil(std::max(desc.capacity / plan.chunk, 1U));
    const auto needed =
        std::bit_ceil(static_cast<std::uint32_t>(ceil_div(desc.capacity, sharing.longest)));
    plan.lanes = std::max(std::clamp(wanted, sharing.least, sharing.most), needed);
    plan.least = gpu ? plan.lanes : std::max(sharing.least, needed);
    plan.groups = gpu ? plan.lanes : plan.lanes / plan.group;
    plan.subgroups = recorder.device().limits.subgroups(plan.group);
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

/// Every view that the kernels bind.
struct Arrays : RadixSortViews {
    vk::BufferView table, places, ranks, totals, range;
};

Arrays arrays_of(const RadixSortDesc& desc, const RadixSortViews& views,
                 const RadixSortWorkspace& space) {
    Arrays arrays{views,
                  space.table.range(),
                  space.places.range(),
                  space.ranks.range(),
                  space.totals.range(),
                  space.range.range()};
    if (!desc.second) arrays.seconds = {space.unused[0].range(), space.unused[1].range()};
    return arrays;
}

std::uint64_t table_bytes(const vk::Recorder& recorder, RadixSortDesc desc) {
    // Keys of fewer bits may have longer digits: 10 bits are two digits of 5, 9 bits are one of 9.
    std::uint64_t most = 0;
    for (; desc.key_bits >= 1; --desc.key_bits) {
        const Plan plan = plan_for(recorder, desc);
        most = std::max(most, std::uint64_t{4} * plan.lanes << plan.digit_bits);
    }
    return most;
}

Status key_range(vk::Recorder& recorder, const Plan& plan, const RadixSortDesc& desc,
                 const Arrays& views) {
    SPLAT_TRY(recorder.fill(views.range, 0xFFFFFFFFU));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_range",
        .constants = {{params::kWorkgroupSizeId, plan.group}},
        .push = params_of(plan, desc, 0),
        .accesses = {vk::read(views.input), vk::read(views.count), vk::read_write(views.range)},
        .groups = {plan.groups, 1, 1},
        .work = {.flops = double{2} * desc.capacity, .bytes = double{8} * desc.capacity},
        .kernels = recorder.kernels(vk::Family::kSort),
    });
}

/// One pass, by one digit. If digits follow the range of the keys, only the device knows which pass
/// is the first, so every pass also binds the input.
struct Pass {
    params::RadixSortParams params;
    std::vector<vk::SpecConstant> constants;
    vk::BufferView input, entries, entries_out, seconds, seconds_out;
    double count = 0;  ///< entries
    double table = 0;  ///< bytes
};

Pass pass_of(const Plan& plan, const RadixSortDesc& desc, const Arrays& views, std::uint32_t pass) {
    const vk::BufferView& entries = pass == 0 ? views.input : views.sides[(pass - 1) % 2];
    return {.params = params_of(plan, desc, pass),
            .constants = {{params::kWorkgroupSizeId, plan.group},
                          {params::kRadixSortBitsId, plan.digit_bits},
                          {params::kRadixSortSecondId, desc.second ? 1U : 0U},
                          {params::kRadixSortRangedId, plan.ranged ? 1U : 0U},
                          {params::kRadixSortMaxSubgroupsId, plan.subgroups}},
            .input = plan.ranged ? views.input : entries,
            .entries = entries,
            .entries_out = views.sides[pass % 2],
            .seconds = views.seconds[1 - pass % 2],
            .seconds_out = views.seconds[pass % 2],
            .count = double{1} * desc.capacity,
            .table = double{4} * (plan.lanes << plan.digit_bits)};
}

Status count_digits(vk::Recorder& recorder, const Plan& plan, const Arrays& views,
                    const Pass& pass) {
    const vk::Kernels kernels = recorder.kernels(vk::Family::kSort);
    std::vector<vk::Access> accesses = {vk::read(pass.input),   vk::read(pass.entries),
                                        vk::read(views.count),  vk::read(views.kept),
                                        vk::write(views.table), vk::read(views.range)};
    if (kernels == vk::Kernels::kCpu) accesses.push_back(vk::write(views.ranks));
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_upsweep",
        .constants = pass.constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {plan.groups, 1, 1},
        .work = {.flops = pass.count, .bytes = 8 * pass.count + pass.table},
        .kernels = kernels,
    });
}

/// Invocations of a GPU's workgroup that sums the counts of one digit, up to 16 each.
std::uint32_t row_group(const vk::Recorder& recorder, const Plan& plan) {
    return vk::workgroup_size(recorder.device(), std::clamp(plan.lanes / 4, 64U, 256U));
}

Status sum_counts(vk::Recorder& recorder, const Plan& plan, const Arrays& views, const Pass& pass) {
    const bool cpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu;
    const bool gpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kGpu;
    const std::uint32_t bins = 1U << plan.digit_bits;
    const std::uint32_t bins_each = cpu ? bins : gpu ? 1 : plan.group;
    std::vector<vk::SpecConstant> constants = pass.constants;
    if (gpu) constants.front().value = row_group(recorder, plan);
    std::vector<vk::Access> accesses = {vk::read_write(views.table), vk::write(views.totals),
                                        vk::read(views.count), vk::read(views.kept),
                                        vk::read(views.range)};
    if (cpu)
        accesses = {vk::read(views.table), vk::read(views.count), vk::read(views.range),
                    vk::write(views.places), vk::read_write(views.kept)};
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_spine",
        .constants = constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {(bins + bins_each - 1) / bins_each, 1, 1},
        .work = {.flops = pass.table / 4, .bytes = 2 * pass.table},
        .kernels = recorder.kernels(vk::Family::kSort),
    });
}

Status move_entries(vk::Recorder& recorder, const Plan& plan, const Arrays& views, const Pass& pass,
                    bool second) {
    const vk::Kernels kernels = recorder.kernels(vk::Family::kSort);
    const bool cpu = kernels == vk::Kernels::kCpu;
    std::vector<vk::Access> accesses = {vk::read(pass.input),
                                        vk::read(pass.entries),
                                        vk::read(views.count),
                                        cpu ? vk::read(views.kept) : vk::read_write(views.kept),
                                        vk::read(cpu ? views.places : views.table),
                                        vk::read(cpu ? views.ranks : views.totals),
                                        vk::read(pass.seconds),
                                        vk::write(pass.entries_out),
                                        vk::write(pass.seconds_out),
                                        vk::read(views.range)};
    return recorder.dispatch({
        .op = "radix_sort",
        .shader = "radix_sort_downsweep",
        .constants = pass.constants,
        .push = pass.params,
        .accesses = accesses,
        .groups = {cpu ? plan.lanes : plan.groups, 1, 1},
        .work = {.flops = pass.count, .bytes = (second ? 24 : 16) * pass.count + pass.table},
        .kernels = kernels,
    });
}

}  // namespace

std::uint64_t RadixSortWorkspace::bytes() const {
    return table.bytes() + places.bytes() + ranks.bytes() + totals.bytes() + range.bytes() +
           unused[0].bytes() + unused[1].bytes();
}

Result<RadixSortWorkspace> allocate_radix_sort(vk::Context& context, const RadixSortDesc& desc) {
    const vk::Recorder recorder(context);
    const bool cpu = recorder.kernels(vk::Family::kSort) == vk::Kernels::kCpu;
    const std::uint64_t table = table_bytes(recorder, desc);
    // Eight lanes of the CPU's spine read a quad each, also where a row has fewer.
    constexpr std::uint64_t kBeyondTable = 7 * 16;
    // 16 bits each, written for four entries at a time.
    const std::uint64_t ranks = ceil_div(std::uint64_t{desc.capacity}, 4) * 8;
    RadixSortWorkspace space;
    const auto allocate = [&](vk::Buffer& buffer, const char* name, std::uint64_t bytes) -> Status {
        SPLAT_ASSIGN(buffer, context.memory().allocate(std::max<std::uint64_t>(bytes, 16),
                                                       vk::MemoryKind::kDevice, name));
        return {};
    };
    SPLAT_TRY(allocate(space.table, "sort table", table + (cpu ? kBeyondTable : 0)));
    SPLAT_TRY(allocate(space.places, "sort places", cpu ? table : 0));
    SPLAT_TRY(allocate(space.ranks, "sort ranks", cpu ? ranks : 0));
    SPLAT_TRY(allocate(space.totals, "sort totals", 4 * kRadixBins));
    SPLAT_TRY(allocate(space.range, "sort range", 0));
    for (vk::Buffer& unused : space.unused) SPLAT_TRY(allocate(unused, "unused", 0));
    return space;
}

std::uint32_t radix_sort_side(const vk::Recorder& recorder, const RadixSortDesc& desc) {
    return (plan_for(recorder, desc).passes + 1) % 2;
}

Status radix_sort(vk::Recorder& recorder, const RadixSortDesc& desc, const RadixSortViews& views,
                  const RadixSortWorkspace& space) {
    SPLAT_ASSERT(desc.capacity >= 1 && desc.capacity <= kMaxSorted);
    for ([[maybe_unused]] const vk::BufferView& view :
         {views.input, views.sides[0], views.sides[1]})
        SPLAT_ASSERT(view.bytes >= 8 * radix_sort_entries(desc.capacity));
    const Arrays arrays = arrays_of(desc, views, space);
    const Plan plan = plan_for(recorder, desc);
    // Only the device knows the first pass of a ranged sort, and so the side of the second values.
    SPLAT_ASSERT(!plan.ranged || !desc.second);
    if (plan.ranged) SPLAT_TRY(key_range(recorder, plan, desc, arrays));
    for (std::uint32_t index = 0; index < plan.passes; ++index) {
        const Pass pass = pass_of(plan, desc, arrays, index);
        SPLAT_TRY(count_digits(recorder, plan, arrays, pass));
        SPLAT_TRY(sum_counts(recorder, plan, arrays, pass));
        SPLAT_TRY(move_entries(recorder, plan, arrays, pass, desc.second));
    }
    return {};
}

}  // namespace splat::raster
