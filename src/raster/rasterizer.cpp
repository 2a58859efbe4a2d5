#include "raster/rasterizer.h"

#include <algorithm>

#include "core/checked_math.h"
#include "core/log.h"
#include "params/tile_bin_params.h"
#include "raster_constants.h"

namespace splat::raster {
namespace {

/// Pairs per item at first. The number that a scene needs is known after its first frame.
constexpr std::uint64_t kFirstPairsPerItem = 4;
constexpr std::uint64_t kLeastCapacity = 4096;

/// Smallest workgroup of blending, in invocations.
constexpr std::uint32_t kLeastWorkgroup = kTileSize * kTileSize;

/// Most Gaussians, and entries of a list, whose numbers float32 holds.
constexpr std::uint32_t kMostIds = 1U << 24;

/// Passes of a call before its pairs are known. One pass if there are no views.
std::uint32_t first_passes(const vk::DeviceInfo& device, const RasterDesc& desc) {
    const std::uint64_t row =
        std::max<std::uint64_t>(std::uint64_t{desc.tiles_x()} * desc.views, 1);
    return static_cast<std::uint32_t>(
        ceil_div(std::uint64_t{desc.drawn_rows().rows()}, max_window_tiles(device) / row));
}

}  // namespace

bool Rasterizer::names(const SetViews& scene) const {
    return scene.same_memory(scene_);
}

std::uint64_t most_items(const vk::DeviceInfo& device, const RasterDesc& desc) {
    const std::uint64_t binding = device.limits.max_storage_buffer_bytes;
    if (!desc.export_gradients || !desc.grad_pose) return binding / (16 * desc.splat_quads());
    return (binding - std::min(binding, pose_partial_bytes(device, desc))) / kPartAlignment *
           kPartAlignment / 48;  // both in one buffer
}

Status check_desc(const vk::DeviceInfo& device, const RasterDesc& desc) {
    const vk::DeviceLimits& limits = device.limits;
    if (desc.width < 1 || desc.height < 1 || desc.views < 1)
        return invalid("rasterizer: %u views of %u x %u pixels, expected at least 1 of each",
                       desc.views, desc.width, desc.height);
    SPLAT_ASSERT(desc.grad_pose || !desc.grad_intrinsics);
    SPLAT_ASSERT(desc.extra || !desc.ids);
    if (desc.rays() && (desc.backward || desc.antialiased))
        return invalid(
            "rasterizer: the convention ray_maximum has neither gradients nor a dilation to "
            "compensate for");
    if (desc.ids && desc.gaussians > kMostIds)
        return unsupported("rasterizer: ids of %u Gaussians, expected at most %u", desc.gaussians,
                           kMostIds);
    if (desc.sh_degree > 3)
        return invalid("rasterizer: spherical harmonics of degree %u, expected 0 to 3",
                       desc.sh_degree);
    if (!(desc.near_plane > 0) || !(desc.far_plane > desc.near_plane))
        return invalid("rasterizer: near plane %g, far plane %g, expected 0 < near < far",
                       static_cast<double>(desc.near_plane), static_cast<double>(desc.far_plane));
    if (limits.max_group_invocations < kLeastWorkgroup)
        return unsupported(
            "rasterizer: workgroups of %u invocations, expected at least %u, one for each "
            "pixel of a tile: use another device",
            limits.max_group_invocations, kLeastWorkgroup);
    const std::uint64_t binding = limits.max_storage_buffer_bytes;
    const std::uint64_t most = most_items(device, desc);
    if (desc.items() > most)
        return unsupported(
            "rasterizer: %u Gaussians in %u views, but the device takes at most %llu in "
            "all at a time: render fewer views per call, or fewer Gaussians",
            desc.gaussians, desc.views, llu(most));
    // Cameras, backgrounds and masks are texel buffers, see table.glsl.
    const std::uint64_t texels = std::max<std::uint64_t>(kCameraQuads, desc.mask_words());
    if (texels * desc.views > limits.max_texel_elements)
        return unsupported(
            "rasterizer: %u views of %u x %u pixels, but the device takes at most %llu such views "
            "at a time: render fewer views per call",
            desc.views, desc.width, desc.height, llu(limits.max_texel_elements / texels));
    if (desc.pixels() > binding / 16)
        return unsupported(
            "rasterizer: %u views of %u x %u pixels, but the device takes at most %llu "
            "pixels at a time: render fewer views per call, or smaller ones",
            desc.views, desc.width, desc.height, llu(binding / 16));
    if (std::uint64_t{desc.tiles_x()} * desc.views > max_window_tiles(device))
        return unsupported(
            "rasterizer: a row of %u tiles in %u views, expected at most %llu in all: "
            "render fewer views per call, or narrower images",
            desc.tiles_x(), desc.views, llu(max_window_tiles(device)));
    return {};
}

Result<std::unique_ptr<Rasterizer>> Rasterizer::create(vk::Context& context,
                                                       const RasterDesc& desc) {
    std::unique_ptr<Rasterizer> self(new Rasterizer(context, desc));
    SPLAT_TRY(check_desc(context.device().info(), desc));
    self->passes_ = first_passes(context.device().info(), desc);
    SPLAT_TRY(self->space_.allocate_items(context, desc));
    SPLAT_TRY(self->count_items());
    SPLAT_TRY(self->allocate_first_pairs());
    return self;
}

Status Rasterizer::allocate_first_pairs() {
    const std::uint64_t first = std::max(kFirstPairsPerItem * desc_.items(), kLeastCapacity);
    const std::uint64_t most = Workspace::max_capacity(context_.device(), desc_);
    return space_.allocate_pairs(context_, desc_,
                                 static_cast<std::uint32_t>(std::min(first, most)));
}

Status Rasterizer::count_items() {
    const auto items = static_cast<std::uint32_t>(now_.items());
    SPLAT_TRY(context_.write(space_.item_count.range(), &items, sizeof items));
    counted_ = items;
    return {};
}

Status Rasterizer::upload(PackedViews views) {
    uploaded_ = {};
    const auto write = [&](const vk::Buffer& to, const auto& values) {
        if (values.empty()) return Status{};
        return context_.write(to.range(), values.data(), values.size() * sizeof values[0]);
    };
    SPLAT_TRY(write(space_.cameras, views.cameras));
    SPLAT_TRY(write(space_.background, views.background));
    SPLAT_TRY(write(space_.active_tiles, views.active_tiles));
    SPLAT_TRY(write(space_.view_ranges, views.view_ranges));
    uploaded_ = std::move(views);
    return {};
}

Status Rasterizer::run_forward(std::uint64_t& needed, std::uint64_t& all) {
    RasterStats sum{};
    needed = all = 0;
    vk::KernelPace& pace = blend_pace(context_, false);
    for (std::uint32_t pass = 0; pass < forward_.size(); ++pass) {
        const double factor = pace.factor;
        SPLAT_TRY(context_.run(forward_[pass]));
        SPLAT_ASSIGN(const PassStats found, read_pass(sum, all));
        needed = std::max(needed, found.needed);
        if (needed > space_.capacity) return {};  // all passes have to run again
        if (found.longest > entries_) {
            pace.factor = std::max(pace.factor, factor);  // it left out what takes long
            SPLAT_TRY(run_parts(pass, static_cast<std::uint32_t>(found.longest)));
        }
    }
    complete(sum);
    return {};
}

Result<Rasterizer::PassStats> Rasterizer::read_pass(RasterStats& sum, std::uint64_t& all) {
    std::array<std::uint32_t, params::kStatWords> words{};
    const vk::Buffer& stats = space_.seen_stats.bytes() > 0 ? space_.seen_stats : space_.stats;
    SPLAT_TRY(context_.read(stats.range(), words.data(), sizeof words));
    sum.visible = std::max<std::uint64_t>(sum.visible, words[params::kStatVisible]);
    sum.non_finite = std::max<std::uint64_t>(sum.non_finite, words[params::kStatNotFinite]);
    sum.pairs += words[params::kStatPairs];
    sum.longest = std::max<std::uint64_t>(sum.longest, words[params::kStatLongest]);
    sum.empty_tiles += words[params::kStatEmptyTiles];
    all += words[params::kStatNeeded];
    return PassStats{words[params::kStatNeeded], words[params::kStatLongest]};
}

/// Set the numbers of a call whose passes are added in `sum`.
void Rasterizer::complete(RasterStats sum) {
    sum.culled = now_.items() - sum.visible - sum.non_finite;
    sum.tiles = std::uint64_t{now_.tiles_x()} * now_.tiles_y() * now_.views;
    sum.passes = passes_;
    sum.runs = stats_.runs;
    sum.bytes = space_.bytes();
    stats_ = sum;
}

/// Passes to go on with if one needs so many pairs.
std::uint32_t Rasterizer::more_passes(std::uint32_t passes, std::uint64_t needed) const {
    const std::uint64_t most = Workspace::max_capacity(context_.device(), desc_);
    if (needed <= most) return passes;
    const std::uint64_t more = passes * (ceil_div(needed, most) + 1);
    return static_cast<std::uint32_t>(std::min<std::uint64_t>(more, now_.drawn_rows().rows()));
}

/// Gradients are added pass by pass, so the number of passes must not depend on earlier calls: it is that of a
/// rasterizer that has drawn nothing. The pairs of all passes tell it if one step of grow() leads there from one pass;
/// else every call begins anew.
bool Rasterizer::could_begin_so(std::uint64_t all) const {
    const std::uint32_t first = first_passes(context_.device().info(), now_);
    return passes_ == first || (first == 1 && passes_ == more_passes(first, all));
}

Status Rasterizer::grow(std::uint64_t needed) {
    const std::uint64_t most = Workspace::max_capacity(context_.device(), desc_);
    forward_.clear();
    backward_.clear();
    if (needed > most) {
        if (passes_ == now_.drawn_rows().rows())
            return unsupported(
                "rasterizer: %llu intersections of Gaussians with one row of tiles, but "
                "the device takes at most %llu: render fewer views per call",
                llu(needed), llu(most));
        passes_ = more_passes(passes_, needed);
        return {};
    }
    const std::uint64_t wanted = std::min(needed + needed / 4, most);
    const Status grown = space_.allocate_pairs(context_, desc_, static_cast<std::uint32_t>(wanted));
    if (grown.code() != Code::kOutOfDeviceMemory || wanted == needed) return grown;
    log(LogLevel::kInfo, "pairs get no room to grow: " + grown.message());
    return space_.allocate_pairs(context_, desc_, static_cast<std::uint32_t>(needed));
}

/// Record the lists of a call. On failure the latest call's stay.
Status Rasterizer::record(const SetViews& scene, const RasterDesc& desc) {
    const RasterDesc before = now_;
    const std::uint32_t passes_before = passes_, entries_before = entries_;
    if (desc.gaussians != now_.gaussians || desc.views != now_.views || desc.rows != now_.rows)
        passes_ = first_passes(context_.device().info(), desc);
    now_ = desc;
    const Status recorded = record_forward(scene);
    if (recorded.ok()) {
        known_ = false;
        return {};
    }
    now_ = before;
    passes_ = passes_before;
    entries_ = entries_before;
    return recorded;
}

Status Rasterizer::forward(const SetViews& scene, const PackedViews& views) {
    return draw(scene, views, {});
}

Status Rasterizer::forward_in_bands(std::uint64_t gaussians, std::span<const Window> bands,
                                    const std::function<Result<SetViews>(const Window& band)>& load,
                                    const PackedViews& views) {
    RasterStats all;
    for (const Window& band : bands) {
        valid_ = false;
        SPLAT_ASSIGN(const SetViews scene, load(band));
        SPLAT_TRY(draw(scene, views, band));
        all.visible = std::max(all.visible, stats_.visible);
        all.non_finite = std::max(all.non_finite, stats_.non_finite);
        all.longest = std::max(all.longest, stats_.longest);
        all.pairs += stats_.pairs;
        all.empty_tiles += stats_.empty_tiles;
        all.passes += stats_.passes;
        all.runs = std::max(all.runs, stats_.runs);
    }
    --all.passes;  // begins with 1
    all.culled = gaussians - all.visible - all.non_finite;
    all.tiles = stats_.tiles;
    all.bytes = stats_.bytes;
    all.banded = gaussians;
    stats_ = all;
    return {};
}

Status Rasterizer::draw(const SetViews& scene, const PackedViews& views, const Window& rows) {
    SPLAT_TRY(finish());
    SPLAT_ASSIGN(const bool changed, prepare(scene, views, rows));
    return changed ? run_to_end() : Status();
}

Result<bool> Rasterizer::prepare(const SetViews& scene, const PackedViews& views,
                                 const Window& rows) {
    RasterDesc desc = desc_;
    desc.rows = rows;
    desc.gaussians = scene.count;
    desc.views = views.count();
    if (desc.gaussians > desc_.gaussians)
        return invalid("rasterizer: %u Gaussians, but it was made for at most %u", desc.gaussians,
                       desc_.gaussians);
    SPLAT_ASSERT(desc.views <= desc_.views);
    SPLAT_TRY(check_items(desc_, desc.gaussians, views));
    SPLAT_ASSERT(views.ranges.end <= desc.gaussians);
    // By this call alone: a driver may round another way in kernels specialised otherwise.
    desc.view_sizes = views.smaller;
    desc.tile_mask = !views.active_tiles.empty();
    desc.ranges = views.ranges;
    if (desc.ranges.used) desc.most_items = views.items;
    const bool resized = desc.gaussians != now_.gaussians || desc.views != now_.views ||
                         desc.view_sizes != now_.view_sizes || desc.tile_mask != now_.tile_mask ||
                         desc.ranges != now_.ranges || desc.items() != now_.items() ||
                         desc.rows != now_.rows;
    const bool moved = views != uploaded_;
    if (desc_.skips.unchanged && valid_ && !moved && !resized && scene.version != 0 &&
        scene.version == scene_.version && scene.same_memory(scene_)) {
        stats_.runs = 0;
        return false;
    }
    // A failure before the device starts leaves the previous call valid, including its gradient.
    PackedViews values = moved ? views : PackedViews();
    const std::uint32_t entries = part_entries(context_, false);
    const bool other_parts = entries != entries_ && stats_.longest > std::min(entries, entries_);
    if (forward_.empty() || resized || other_parts || !scene.same_memory(scene_))
        SPLAT_TRY(record(scene, desc));
    scene_ = scene;
    valid_ = false;
    if (counted_ != now_.items()) SPLAT_TRY(count_items());
    if (moved) SPLAT_TRY(upload(std::move(values)));
    return true;
}

Status Rasterizer::run_to_end() {
    bool began = false;  // this call, with the passes of a new rasterizer
    for (stats_.runs = 1;; ++stats_.runs) {
        if (forward_.empty()) SPLAT_TRY(record_forward(scene_));
        std::uint64_t needed = 0, all = 0;
        SPLAT_TRY(run_forward(needed, all));
        if (needed > space_.capacity) {
            SPLAT_TRY(grow(needed));
        } else if (began || could_begin_so(all)) {
            break;
        } else {
            began = true;
            passes_ = first_passes(context_.device().info(), now_);
            forward_.clear();
            backward_.clear();
        }
    }
    if (stats_.longest >= kMostIds)
        return unsupported("rasterizer: %llu Gaussians on one tile, expected fewer than %u",
                           llu(stats_.longest), kMostIds);
    valid_ = known_ = true;
    return {};
}

Status Rasterizer::backward(const vk::BufferView& grad_image, const vk::BufferView& grad_depth,
                            const SetViews& gradients) {
    if (!desc_.backward) return invalid("rasterizer: made without backward; set it when creating");
    SPLAT_TRY(finish());
    if (!valid_)
        return invalid("rasterizer: backward needs a forward call that succeeded before it");
    const std::array<vk::BufferView, 4> views = {grad_image, grad_depth, gradients.gaussians,
                                                 gradients.colors};
    const std::uint32_t entries = part_entries(context_, true);
    const bool other_parts =
        stats_.longest > backward_longest_ ||
        (entries != backward_entries_ && stats_.longest > std::min(entries, backward_entries_));
    const bool recorded =
        !backward_.empty() && !other_parts && gradients.sh_degree == backward_degree_ &&
        std::equal(
            views.begin(), views.end(), backward_views_.begin(),
            [](const vk::BufferView& a, const vk::BufferView& b) { return a.same_range(b); });
    if (!recorded) {
        backward_.clear();
        backward_entries_ = entries;
        SPLAT_TRY(record_backward(grad_image, grad_depth, gradients));
        backward_views_ = views;
        backward_degree_ = gradients.sh_degree;
    }
    for (std::size_t pass = 0; pass < backward_.size(); ++pass) {
        if (backward_.size() > 1) SPLAT_TRY(context_.run(forward_[pass]));  // lists overwritten
        SPLAT_TRY(context_.run(backward_[pass]));
    }
    return {};
}

}  // namespace splat::raster
