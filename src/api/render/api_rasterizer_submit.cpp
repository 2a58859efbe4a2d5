#include "api/render/raster_calls.h"

using namespace splat;

namespace {

/// Numbers of Vulkan, as the header names them.
constexpr std::uint32_t kBytes = 37, kHalves = 97, kFloats = 109;
constexpr std::uint32_t kUndefined = 0, kPreinitialized = 8;

Result<raster::PixelFormat> format_of(std::uint32_t format) {
    if (format == kBytes) return raster::PixelFormat::kBytes;
    if (format == kHalves) return raster::PixelFormat::kHalves;
    if (format == kFloats) return raster::PixelFormat::kFloats;
    return invalid(
        "splat_vulkan_target.format is %u, expected VK_FORMAT_R8G8B8A8_UNORM (%u), "
        "VK_FORMAT_R16G16B16A16_SFLOAT (%u) or VK_FORMAT_R32G32B32A32_SFLOAT (%u)",
        format, kBytes, kHalves, kFloats);
}

Status check_target(const splat_vulkan_target& given, const raster::RasterDesc& desc,
                    raster::PixelFormat format) {
    if ((given.image == 0) == (given.buffer == 0))
        return invalid("splat_vulkan_target.image and buffer are %s, expected one of them",
                       given.image == 0 ? "both 0" : "both given");
    if (given.wait_semaphore == 0 && given.wait_value != 0)
        return invalid(
            "splat_vulkan_target.wait_value is %llu without a wait_semaphore, expected 0",
            llu(given.wait_value));
    if (given.image != 0) {
        if (given.offset != 0 || given.bytes != 0)
            return invalid("splat_vulkan_target.%s is %llu, expected 0 with an image",
                           given.offset != 0 ? "offset" : "bytes",
                           llu(given.offset != 0 ? given.offset : given.bytes));
        if (given.layout == kUndefined || given.layout == kPreinitialized)
            return invalid(
                "splat_vulkan_target.layout is %u, expected a layout that an image can be left in, "
                "such as 1, the general one",
                given.layout);
        return {};
    }
    const std::uint64_t needed =
        std::uint64_t{desc.width} * desc.height * raster::pixel_bytes(format);
    if (given.layout != 0)
        return invalid("splat_vulkan_target.layout is %u, expected 0 with a buffer", given.layout);
    if (given.offset % 4 != 0)
        return invalid("splat_vulkan_target.offset is %llu, expected a multiple of 4",
                       llu(given.offset));
    if (given.bytes < needed)
        return invalid("splat_vulkan_target.bytes is %llu, but %u x %u pixels take %llu",
                       llu(given.bytes), desc.width, desc.height, llu(needed));
    return {};
}

}  // namespace

splat_result splat_rasterizer_submit(splat_rasterizer rasterizer, splat_raster_state state,
                                     splat_scene scene, const splat_camera* camera,
                                     const float* background, const splat_vulkan_target* target,
                                     splat_vulkan_frame* frame) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const auto object, api::find_state(rasterizer, state));
        SPLAT_ASSIGN(const auto from, api::find(scene));
        SPLAT_TRY(api::require(camera, "camera", target, "target"));
        splat_vulkan_target given{};
        SPLAT_TRY(api::check_desc(target, 0));
        SPLAT_TRY(api::take_input(target, "target", given));
        SPLAT_TRY(api::check_fill(frame, "frame"));
        SPLAT_ASSIGN(const raster::PixelFormat format, format_of(given.format));
        SPLAT_TRY(check_target(given, object->rasterizer->desc(), format));
        SPLAT_ASSIGN(const raster::PackedViews views,
                     api::views_of_call(*object, camera, 1, background));
        if (!object->context->device().adopted())
            return bad_state(
                "the device is the library's own, whose images are no application's: open one on "
                "the application's device");
        api::warn_of_drawn_as(*object, *from);
        vk::FrameTarget to;
        SPLAT_COPY(to, given, image, buffer, offset, layout, wait_semaphore, wait_value);
        splat_vulkan_frame filled{};
        const api::Draw submit = [&](const gaussians::SetViews& set,
                                     const raster::PackedViews& packed) -> Status {
            const auto submitted = object->rasterizer->submit(set, packed, format, to);
            object->describe();
            SPLAT_ASSIGN(const raster::RasterFrame done, submitted);
            filled.waited = done.waited ? 1 : 0;
            filled.semaphore = object->context->frame_semaphore();
            SPLAT_COPY(filled, done, value, lost);
            return {};
        };
        SPLAT_TRY(api::draw_scene(*object, *from, views, {}, submit));
        api::give(filled, frame);
        return {};
    });
}
