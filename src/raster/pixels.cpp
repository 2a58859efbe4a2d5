#include "raster/pixels.h"

#include "params/raster_reduce_params.h"
#include "vk/launch.h"

namespace splat::raster {

Status raster_pixels(vk::Recorder& recorder, PixelFormat format, std::uint64_t count,
                     const vk::BufferView& image, const vk::BufferView& pixels) {
    if (format == PixelFormat::kFloats)
        return recorder.copy(image.part(0, count * 16), pixels.part(0, count * 16));
    const std::uint32_t size = vk::workgroup_size(recorder.device(), 64);
    const vk::Groups groups = vk::groups_for(recorder.device(), count, size);
    const params::RasterPixelsParams params{.count = static_cast<std::uint32_t>(count),
                                            .groups_x = groups[0]};
    const auto bytes = static_cast<double>(count * (16 + pixel_bytes(format)));
    return recorder.dispatch({
        .op = "raster_pixels",
        .shader = "raster_pixels",
        .constants = {{params::kWorkgroupSizeId, size},
                      {params::kReduceHalvesId, format == PixelFormat::kHalves ? 1U : 0U}},
        .push = params,
        .accesses = {vk::read(image), vk::write(pixels)},
        .groups = groups,
        .work = {.flops = 40 * static_cast<double>(count), .bytes = bytes},
    });
}

}  // namespace splat::raster
