#include "raster/project.h"

#include <algorithm>
#include <numbers>

#include "core/checked_math.h"
#include "params/project_params.h"
#include "params/raster_reduce_params.h"
#include "vk/launch.h"

namespace splat::raster {
namespace {

/// Flops of one projection and of its gradient. They only decide the length of submits.
constexpr double kForwardFlops = 400;
constexpr double kBackwardFlops = 1200;

constexpr std::uint32_t kGroup = 64;

params::ProjectParams params_of(const RasterDesc& desc, const Window& window) {
    params::ProjectParams params{};
    params.gaussians = desc.gaussians;
    params.width = desc.width;
    params.height = desc.height;
    params.row_begin = window.row_begin;
    params.row_end = window.row_end;
    params.sh_degree = desc.sh_degree;
    params.sh_quads = desc.color_quads();
    params.near_plane = desc.near_plane;
    params.far_plane = desc.far_plane;
    params.views = desc.views;
    params.rays = static_cast<std::uint32_t>(3 * desc.items());
    return params;
}

std::uint32_t group_size(const vk::Recorder& recorder) {
    return projection_group(recorder.device());
}

/// Workgroups over Gaussians: `count` of them, or those of the ranges.
vk::Groups groups_of(const vk::Recorder& recorder, const RasterDesc& desc, std::uint32_t count) {
    const std::uint32_t size = group_size(recorder);
    return vk::groups_for(recorder.device(),
                          desc.ranges.used ? std::uint64_t{desc.ranges.groups} * size : count,
                          size);
}

/// Elements of `bytes` from the start of `first` to that of `second`, which lies behind it.
std::uint32_t distance(const vk::BufferView& first, const vk::BufferView& second,
                       std::uint32_t bytes) {
    SPLAT_ASSERT(first.buffer == second.buffer && first.offset <= second.offset);
    return static_cast<std::uint32_t>((second.offset - first.offset) / bytes);
}

/// The counts and the first records behind them.
vk::BufferView counts_and_begins(const ItemViews& items, const RecordViews& records) {
    return items.counts.part(0, records.begins.end() - items.counts.offset);
}

/// Quads that a workgroup writes for each view: rows of dL/d[R|t], intrinsics.
std::uint32_t pose_quads(const RasterDesc& desc) {
    return desc.grad_intrinsics ? 4 : 3;
}

/// One dispatch, for `count` Gaussians from `first`: one invocation per Gaussian and view. With ranges a workgroup
/// belongs to the slice in which its first Gaussian lies, so that slices overlap.
struct Slice {
    std::uint32_t first;
    std::uint32_t count;
    double items;
    params::ProjectParams params;
    vk::Groups groups;
};

/// Layers of workgroups of the projection: one for each view, or one for all their ranges.
std::uint32_t layers_of(const RasterDesc& desc) {
    return desc.ranges.used ? 1 : desc.views;
}

/// Share of a call's records that one dispatch of the backward pass reads: each layer of ranges has its own.
double layer_share(const RasterDesc& desc) {
    return 1.0 / std::max(desc.ranges.layers, 1U);
}

/// Call `record(slice)` for each slice of Gaussians.
template <class Record>
Status for_slices(const vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                  const Record& record) {
    const std::uint32_t most = slice_size(recorder.device(), recorder.kernels(), desc);
    const std::uint32_t size = desc.ranges.used ? most - kGroup : most;
    for (std::uint32_t first = 0; first < desc.gaussians; first += size) {
        const std::uint32_t count = std::min(most, desc.gaussians - first);
        const vk::Groups groups = groups_of(recorder, desc, count);
        const double share = double{1} * count / desc.gaussians;
        Slice slice{first, count, share * static_cast<double>(desc.items()),
                    params_of(desc, window), groups};
        slice.params.first = first;
        slice.params.count = std::min(size, count);
        slice.params.groups_x = groups[0];
        SPLAT_TRY(record(slice));
    }
    return {};
}

}  // namespace

std::uint32_t projection_group(const vk::DeviceInfo& device) {
    return vk::workgroup_size(device, kGroup);
}

Status project_forward(vk::Recorder& recorder, const RasterDesc& desc, const Window& window,
                       const SetViews& scene, const CallViews& call, const ItemViews& items) {
    const std::uint32_t quads = desc.color_quads();
    return for_slices(recorder, desc, window, [&](const Slice& part) {
        return recorder.dispatch({
            .op = "project_forward",
            .shader = "project_forward",
            .constants = {{params::kWorkgroupSizeId, group_size(recorder)},
                          {params::kProjectDegreeId,
                           desc.direct_colors ? 0 : std::min(desc.sh_degree, scene.sh_degree)},
                          {params::kProjectFlagsId, desc.flags()}},
            .push = part.params,
            .accesses = {vk::read(slice(scene.gaussians, part.first, part.count, 3)),
                         vk::read(slice(scene.colors, part.first, part.count, quads)),
                         vk::read(call.cameras), vk::write(items.splats), vk::write(items.counts),
                         vk::write(items.keys), vk::write(items.radii), vk::write(items.footprints),
                         vk::read_write(items.stats), vk::read(call.background),
                         vk::read(call.active_tiles), vk::read(call.ranges)},
            .groups = {part.groups[0], part.groups[1], layers_of(desc)},
            .work = {.flops = (kForwardFlops + 40 * quads) * part.items,
                     .bytes = (112.0 + 16 * quads) * part.items},
        });
    });
}

Status project_normals(vk::Recorder& recorder, const RasterDesc& desc, const SetViews& scene,
                       const CallViews& call, const ItemViews& items,
                       const vk::BufferView& normals) {
    return for_slices(recorder, desc, {}, [&](const Slice& part) {
        return recorder.dispatch({
            .op = "project_normals",
            .shader = "project_normals",
            .constants = {{params::kWorkgroupSizeId, group_size(recorder)},
                          {params::kProjectFlagsId, desc.flags()}},
            .push = part.params,
            .accesses = {vk::read(slice(scene.gaussians, part.first, part.count, 3)),
                         vk::read(call.cameras), vk::read(items.counts), vk::write(normals),
                         vk::read(call.ranges)},
            .groups = {part.groups[0], part.groups[1], layers_of(desc)},
            .work = {.flops = 80.0 * part.items, .bytes = 68.0 * part.items},
        });
    });
}

std::uint64_t pose_partial_bytes(const vk::DeviceInfo& device, const RasterDesc& desc) {
    if (!desc.grad_pose) return 0;
    const std::uint64_t size = projection_group(device);
    const std::uint64_t groups =
        std::min(ceil_div(std::uint64_t{desc.gaussians}, size) * desc.views,
                 desc.items() / size + desc.views);
    return groups * pose_quads(desc) * 16;
}

Status project_backward(vk::Recorder& recorder, const RasterDesc& desc, const SetViews& scene,
                        const CallViews& call, const ItemViews& items, const RecordViews& records,
                        const SetViews& gradients, const ProjectionGradients& projection,
                        bool accumulate) {
    const std::uint32_t quads = desc.color_quads();
    if (desc.ranges.used && !desc.ranges.covers && !accumulate) {
        SPLAT_TRY(recorder.fill(gradients.gaussians, 0));
        SPLAT_TRY(recorder.fill(gradients.colors, 0));
    }
    std::uint32_t layer = 0;
    const auto record = [&](Slice part) {
        part.params.accumulate = accumulate ? 1 : 0;
        part.params.layer = layer;
        part.params.begins = distance(items.counts, records.begins, 4);
        part.params.pose = distance(projection.exported, projection.pose_partial, 16);
        part.params.record_quads = desc.record_quads();
        std::vector<vk::Access> accesses = {
            vk::read(slice(scene.gaussians, part.first, part.count, 3)),
            vk::read(slice(scene.colors, part.first, part.count, quads)),
            vk::read(call.cameras),
            vk::read(items.splats),
            vk::read(counts_and_begins(items, records)),
            vk::read_write(slice(gradients.gaussians, part.first, part.count, 3)),
            vk::read_write(slice(gradients.colors, part.first, part.count, quads)),
            vk::read_write(projection.exported),
            vk::read(call.ranges)};
        double record_bytes = 0;  // there is room for as many
        for (std::size_t i = 0; i < std::min<std::size_t>(records.sums.size(), 3); ++i) {
            accesses.push_back(vk::read(records.sums[i]));
            record_bytes += static_cast<double>(records.sums[i].bytes);
        }
        const double share = part.items / static_cast<double>(desc.items()) * layer_share(desc);
        return recorder.dispatch({
            .op = "project_backward",
            .shader = "project_backward",
            .constants = {{params::kWorkgroupSizeId, group_size(recorder)},
                          {params::kProjectDegreeId,
                           desc.direct_colors ? 0 : std::min(desc.sh_degree, gradients.sh_degree)},
                          {params::kProjectExportId, desc.export_gradients ? 1U : 0U},
                          {params::kProjectPoseId, desc.grad_pose ? 1U : 0U},
                          {params::kProjectIntrinsicsId, desc.grad_intrinsics ? 1U : 0U},
                          {params::kProjectFlagsId, desc.flags()}},
            .push = part.params,
            .accesses = std::move(accesses),
            .groups = part.groups,
            .work = {.flops = kBackwardFlops * part.items + record_bytes / 4 * share,
                     .bytes = 16.0 * (12 + 2 * quads) * part.items + record_bytes * share},
            .kernels = records.apart() ? vk::Kernels::kCpu : vk::Kernels::kPlain,
        });
    };
    do {
        SPLAT_TRY(for_slices(recorder, desc, {}, record));
    } while (++layer < desc.ranges.layers);
    if (!desc.grad_pose) return {};
    const auto partial_groups =
        static_cast<std::uint32_t>(ceil_div(std::uint64_t{desc.gaussians}, group_size(recorder)));
    const params::PoseReduceParams params{partial_groups, accumulate ? 1U : 0U,
                                          group_size(recorder), pose_quads(desc)};
    return recorder.dispatch({
        .op = "pose_reduce",
        .shader = "pose_reduce",
        .constants = {{params::kWorkgroupSizeId,
                       vk::workgroup_size(recorder.device(), 64, partial_groups)},
                      {params::kReduceRangesId, desc.ranges.used ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read(projection.pose_partial), vk::read_write(projection.pose),
                     vk::read_write(projection.intrinsics), vk::read(call.ranges)},
        .groups = {desc.views, 1, 1},
        .work = {.flops = 12.0 * partial_groups * desc.views,
                 .bytes = 48.0 * partial_groups * desc.views},
    });
}

Status sum_contributions(vk::Recorder& recorder, const RasterDesc& desc, const CallViews& call,
                         const ItemViews& items, const RecordViews& records,
                         const vk::BufferView& contributions, bool accumulate) {
    const vk::Groups groups = groups_of(recorder, desc, desc.gaussians);
    params::ContributionReduceParams params{
        .gaussians = desc.gaussians,
        .views = desc.views,
        .accumulate = accumulate ? 1U : 0U,
        .groups_x = groups[0],
        .begins = distance(items.counts, records.begins, 4),
        .stride = records.apart() ? 1U : 2 * desc.record_quads(),
        .first = records.apart() ? 0U : 6U,
        .layer = 0};
    const auto count = static_cast<double>(desc.items());
    const double record_bytes = static_cast<double>(records.sums.back().bytes) * layer_share(desc);
    if (desc.ranges.used && !desc.ranges.covers && !accumulate)
        SPLAT_TRY(recorder.fill(contributions, 0));
    do {
        SPLAT_TRY(recorder.dispatch({
            .op = "contribution_reduce",
            .shader = "contribution_reduce",
            .constants = {{params::kWorkgroupSizeId, group_size(recorder)},
                          {params::kReduceRangesId, desc.ranges.used ? 1U : 0U}},
            .push = params,
            .accesses = {vk::read(counts_and_begins(items, records)), vk::read(records.sums.back()),
                         vk::read_write(contributions), vk::read(call.ranges)},
            .groups = groups,
            .work = {.flops = 20 * count + record_bytes / 4, .bytes = 40 * count + record_bytes},
        }));
    } while (++params.layer < desc.ranges.layers);
    return {};
}

std::vector<float> conics_of(std::span<const float> splats, std::span<const float> radii) {
    // The kernels keep the Cholesky factor of the conic, scaled to powers of two.
    constexpr double kScale = 2 * std::numbers::ln2;
    std::vector<float> conics(radii.size() / 2 * 3);
    for (std::size_t i = 0; i < radii.size() / 2; ++i) {
        if (!(radii[2 * i] > 0)) continue;
        const auto l11 = static_cast<double>(splats[12 * i + 4]);
        const auto l21 = static_cast<double>(splats[12 * i + 5]);
        const auto l22 = static_cast<double>(splats[12 * i + 6]);
        conics[3 * i] = static_cast<float>(kScale * l11 * l11);
        conics[3 * i + 1] = static_cast<float>(kScale * l11 * l21);
        conics[3 * i + 2] = static_cast<float>(kScale * (l21 * l21 + l22 * l22));
    }
    return conics;
}

}  // namespace splat::raster
