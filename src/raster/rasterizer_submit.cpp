#include "core/checked_math.h"
#include "params/tile_bin_params.h"
#include "raster/rasterizer.h"

namespace splat::raster {

Status Rasterizer::finish() {
    if (flying_ == 0) return {};
    const std::uint64_t frame = std::exchange(flying_, 0);
    valid_ = false;
    SPLAT_TRY(context_.settle());
    RasterStats sum{};
    std::uint64_t all = 0;
    SPLAT_ASSIGN(const PassStats pass, read_pass(sum, all));
    if (pass.needed > space_.capacity) {
        lost_ = frame;
        return grow(pass.needed);
    }
    complete(sum);
    if (pass.longest > entries_)
        lost_ = frame;
    else
        valid_ = true;
    return {};
}

Status Rasterizer::record_pixels(PixelFormat format) {
    if (!pixels_list_.empty() && format == pixel_format_) return {};
    const std::uint64_t count = std::uint64_t{desc_.width} * desc_.height;
    const std::uint64_t bytes = round_up(count * pixel_bytes(format), std::uint64_t{16});
    pixels_list_ = {};
    if (pixels_.bytes() < bytes)
        SPLAT_SET(pixels_, context_.memory().allocate(bytes, vk::MemoryKind::kDevice,
                                                      "rasterizer: pixels of a frame"));
    vk::Recorder recorder(context_);
    SPLAT_TRY(raster_pixels(recorder, format, count, space_.image.range().part(0, count * 16),
                            pixels_.range().part(0, bytes)));
    SPLAT_SET(pixels_list_, recorder.finish());
    pixel_format_ = format;
    return context_.make_ready(pixels_list_);
}

Result<RasterFrame> Rasterizer::submit(const SetViews& scene, const PackedViews& views,
                                       PixelFormat format, vk::FrameTarget target) {
    SPLAT_ASSERT(views.count() == 1);
    SPLAT_TRY(finish());
    SPLAT_TRY(record_pixels(format));
    RasterFrame frame;
    const vk::BatchScope scope(context_, frames_);
    SPLAT_ASSIGN(const bool changed, prepare(scene, views, {}));
    frame.waited = changed && (!known_ || passes_ > 1 || stats_.longest > entries_);
    if (frame.waited)
        SPLAT_TRY(run_to_end());
    else if (changed)
        SPLAT_TRY(context_.run(forward_[0]));
    SPLAT_TRY(context_.run(pixels_list_));
    target.width = desc_.width;
    target.height = desc_.height;
    const std::uint64_t count = std::uint64_t{desc_.width} * desc_.height;
    SPLAT_SET(frame.value,
              context_.submit_frame(pixels_.range().part(0, count * pixel_bytes(format)), target));
    frame.lost = std::exchange(lost_, 0);
    if (changed && !frame.waited) {
        flying_ = frame.value;
        stats_.runs = 1;
        valid_ = true;
    }
    return frame;
}

}  // namespace splat::raster
