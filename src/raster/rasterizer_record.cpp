#include "raster/rasterizer.h"

namespace splat::raster {

TileRanges Rasterizer::tile_views() const {
    return {space_.ranges.range(), space_.order.range(), space_.stats.range()};
}

CallViews Rasterizer::call_views() const {
    return {space_.cameras.range(), space_.background.range(), space_.active_tiles.range(),
            space_.view_ranges.range()};
}

BlendViews Rasterizer::blend_views(const Window& window) const {
    const std::uint32_t bits = tile_key_bits(now_, window);
    const vk::Recorder recorder(context_);
    const std::uint32_t side =
        radix_sort_side(recorder, {.capacity = space_.capacity, .key_bits = bits});
    return {.splats = space_.splats.range(),
            .pairs = space_.pairs.entries[side].range(),
            .normals = space_.normals.range(),
            .slots = space_.pairs.slots[side].range(),
            .ranges = space_.ranges.range(),
            .order = space_.order.range(),
            .background = space_.background.range(),
            .image = space_.image.range(),
            .state = space_.state.range(),
            .extra = space_.extra.range(),
            .median = space_.median.range()};
}

Status Rasterizer::record_forward_pass(vk::Recorder& recorder, const SetViews& scene,
                                       const Window& window) {
    const auto items = static_cast<std::uint32_t>(now_.items());
    const RadixSortDesc by_depth = {.capacity = items};
    const RadixSortDesc by_tile = {.capacity = space_.capacity,
                                   .key_bits = tile_key_bits(now_, window),
                                   .second = now_.backward};
    const vk::BufferView order = space_.item_order[radix_sort_side(recorder, by_depth)].range();
    SPLAT_TRY(recorder.fill(space_.stats.range(), 0));
    SPLAT_TRY(project_forward(recorder, now_, window, scene, call_views(), space_.items()));
    SPLAT_TRY(radix_sort(recorder, by_depth,
                         {.input = space_.item_keys.range(),
                          .sides = {space_.item_order[0].range(), space_.item_order[1].range()},
                          .seconds = {},
                          .count = space_.item_count.range(),
                          .kept = space_.sorted.range()},
                         space_.item_sort));
    SPLAT_TRY(tile_bin(recorder, now_, {space_.capacity, window},
                       {.splats = space_.splats.range(),
                        .counts = space_.items().counts,
                        .footprints = space_.footprints.range(),
                        .order = order,
                        .sorted = space_.sorted.range(),
                        .sums = space_.sums.range(),
                        .begins = space_.begins.range(),
                        .slot_begins = space_.slot_begins(),
                        .pairs = space_.pairs.entries[1].range(),
                        .slots = space_.pairs.slots[1].range(),
                        .large = space_.large.range(),
                        .pair_count = space_.pair_count.range(),
                        .stats = space_.stats.range(),
                        .background = space_.background.range(),
                        .active_tiles = space_.active_tiles.range(),
                        .view_ranges = space_.view_ranges.range()}));
    SPLAT_TRY(
        radix_sort(recorder, by_tile,
                   {.input = space_.pairs.entries[1].range(),
                    .sides = {space_.pairs.entries[0].range(), space_.pairs.entries[1].range()},
                    .seconds = {space_.pairs.slots[0].range(), space_.pairs.slots[1].range()},
                    .count = space_.pair_count.range(),
                    .kept = space_.kept_pairs.range()},
                   space_.pairs.sort));
    const std::uint32_t side = radix_sort_side(recorder, by_tile);
    SPLAT_TRY(tile_ranges(recorder, now_, window, space_.pairs.entries[side].range(),
                          space_.kept_pairs.range(), tile_views()));
    return record_blend(recorder, scene, window);
}

Status Rasterizer::record_blend(vk::Recorder& recorder, const SetViews& scene,
                                const Window& window) {
    const std::uint64_t pairs = now_.items() > 0 ? space_.capacity : 0;
    BlendViews views = blend_views(window);
    SPLAT_TRY(blend_forward(recorder, now_, window, views, pairs, false, {entries_}));
    if (!now_.normals) return {};
    if (now_.items() == 0) return recorder.fill(space_.normal_image.range(), 0);
    SPLAT_TRY(project_normals(recorder, now_, scene, call_views(), space_.items(),
                              space_.normals.range()));
    views.image = space_.normal_image.range();
    return blend_forward(recorder, now_, window, views, pairs, true, {entries_});
}

Status Rasterizer::run_parts(std::uint32_t pass, std::uint32_t longest) {
    parts_.resize(forward_.size());
    Parts& parts = parts_[pass];
    if (longest > parts.longest) {
        parts = {};
        const Window window = pass_window(now_, pass, passes_);
        BlendViews views = blend_views(window);
        vk::Recorder recorder(context_);
        recorder.bounds = true;
        for (const bool normals : {false, true}) {
            if (normals && !now_.normals) continue;
            if (normals) views.image = space_.normal_image.range();
            for (std::uint64_t begin = 0; begin < longest; begin += entries_)
                SPLAT_TRY(blend_forward(recorder, now_, window, views, space_.capacity, normals,
                                        {entries_, true, static_cast<std::uint32_t>(begin)}));
        }
        SPLAT_ASSIGN(parts.list, recorder.finish());
        parts.longest = round_up(longest, entries_);
    }
    return context_.run(parts.list);
}

Status Rasterizer::record_forward(const SetViews& scene) {
    if (space_.capacity == 0) SPLAT_TRY(allocate_first_pairs());  // growing failed
    entries_ = part_entries(context_, false);
    std::vector<vk::CommandList> lists;
    for (std::uint32_t pass = 0; pass < passes_; ++pass) {
        const Window window = pass_window(now_, pass, passes_);
        vk::Recorder recorder(context_);
        recorder.bounds = true;
        if (now_.views == 0) {
            SPLAT_TRY(recorder.fill(space_.stats.range(), 0));
        } else if (now_.items() > 0) {
            SPLAT_TRY(record_forward_pass(recorder, scene, window));
        } else {
            SPLAT_TRY(recorder.fill(space_.kept_pairs.range(), 0));
            SPLAT_TRY(recorder.fill(space_.stats.range(), 0));
            SPLAT_TRY(tile_ranges(recorder, now_, window, space_.pairs.entries[0].range(),
                                  space_.kept_pairs.range(), tile_views()));
            SPLAT_TRY(record_blend(recorder, scene, window));
        }
        if (space_.seen_stats.bytes() > 0)
            SPLAT_TRY(recorder.copy(space_.stats.range(), space_.seen_stats.range()));
        SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
        SPLAT_TRY(context_.make_ready(list));
        lists.push_back(std::move(list));
    }
    forward_ = std::move(lists);
    parts_.clear();
    backward_.clear();
    return {};
}

Status Rasterizer::record_backward(const vk::BufferView& grad_image,
                                   const vk::BufferView& grad_depth, const SetViews& gradients) {
    backward_longest_ = round_up(std::max<std::uint64_t>(stats_.longest, 1), backward_entries_);
    std::vector<vk::CommandList> lists;
    for (std::uint32_t pass = 0; pass < passes_; ++pass) {
        const Window window = pass_window(now_, pass, passes_);
        vk::Recorder recorder(context_);
        recorder.bounds = true;
        const auto blend_back = [&](const ListPart& part, std::uint64_t pairs) {
            return blend_backward(recorder, now_, window, blend_views(window), grad_image,
                                  grad_depth, space_.records(), pairs, part);
        };
        if (now_.items() > 0) {
            const bool whole = backward_longest_ == backward_entries_;
            SPLAT_TRY(blend_back({backward_entries_},
                                 whole ? space_.capacity : stats_.pairs - stats_.longest));
            for (std::uint64_t begin = whole ? 0 : backward_longest_; begin > 0;) {
                begin -= backward_entries_;
                SPLAT_TRY(blend_back({backward_entries_, true, static_cast<std::uint32_t>(begin)},
                                     space_.capacity));
            }
            SPLAT_TRY(project_backward(recorder, now_, scene_, call_views(), space_.items(),
                                       space_.records(), gradients, space_.projection(), pass > 0));
            if (now_.contributions)
                SPLAT_TRY(sum_contributions(recorder, now_, call_views(), space_.items(),
                                            space_.records(), space_.contributions.range(),
                                            pass > 0));
        } else {
            SPLAT_TRY(recorder.fill(space_.pose.range(), 0));
            SPLAT_TRY(recorder.fill(space_.intrinsics.range(), 0));
            SPLAT_TRY(recorder.fill(space_.contributions.range(), 0));
            if (now_.gaussians > 0) {  // no views
                SPLAT_TRY(recorder.fill(gradients.gaussians, 0));
                SPLAT_TRY(recorder.fill(gradients.colors, 0));
            }
        }
        SPLAT_ASSIGN(vk::CommandList list, recorder.finish());
        lists.push_back(std::move(list));
    }
    backward_ = std::move(lists);
    return {};
}

}  // namespace splat::raster
