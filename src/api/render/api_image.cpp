#include <cctype>
#include <cstring>

#include "api/api_guard.h"
#include "io/apng.h"
#include "io/file.h"
#include "io/gif.h"
#include "io/image.h"
#include "io/npy.h"
#include "scene/camera_pose.h"

using namespace splat;

namespace {

Status check(const char* path, const float* values, std::uint32_t width, std::uint32_t height,
             std::uint32_t channels) {
    SPLAT_TRY(api::require(path, "path"));
    SPLAT_TRY(api::require(values, "values"));
    const auto in_range = [](const char* name, std::uint32_t value, std::uint32_t most) -> Status {
        if (value >= 1 && value <= most) return {};
        return error(Code::kInvalidArgument, "%s is %u, expected 1 to %u", name, value, most);
    };
    SPLAT_TRY(in_range("width", width, scene::kMaxImageSide));
    SPLAT_TRY(in_range("height", height, scene::kMaxImageSide));
    return in_range("channels", channels, 4);
}

bool has_extension(const char* path, const char* extension) {
    std::string text = path;
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return text.ends_with(extension);
}

Result<io::Buffer> file_of(const char* path, std::span<const float> values, std::uint32_t width,
                           std::uint32_t height, std::uint32_t channels) {
    if (has_extension(path, ".png"))
        return io::write_png(io::image_from_floats(values, width, height, channels));
    if (has_extension(path, ".npy"))
        return io::write_npy({{height, width, channels}, {values.begin(), values.end()}});
    return error(Code::kUnsupported, "'%s': expected the extension .png or .npy", path);
}

Result<io::Buffer> animation_of(const char* path, const std::vector<io::Image>& frames,
                                const io::AnimationOptions& options) {
    return has_extension(path, ".gif") ? io::write_gif(frames, options)
                                       : io::write_apng(frames, options);
}

}  // namespace

splat_result splat_image_save(const char* path, const float* values, uint32_t width,
                              uint32_t height, uint32_t channels) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(check(path, values, width, height, channels));
        const std::size_t count = std::size_t{width} * height * channels;
        SPLAT_ASSIGN(const io::Buffer file,
                     file_of(path, {values, count}, width, height, channels));
        return io::write_file(path, file);
    });
}

splat_result splat_image_save_animation(const char* path, const float* values, uint32_t frames,
                                        uint32_t width, uint32_t height, uint32_t channels,
                                        uint32_t milliseconds) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(check(path, values, width, height, channels));
        if (frames == 0) return error(Code::kInvalidArgument, "frames is 0, expected at least 1");
        if (milliseconds < 1 || milliseconds > 65535)
            return error(Code::kInvalidArgument, "milliseconds is %u, expected 1 to 65535",
                         milliseconds);
        if (!has_extension(path, ".png") && !has_extension(path, ".gif"))
            return error(Code::kUnsupported, "'%s': expected the extension .png or .gif", path);
        const std::size_t count = std::size_t{width} * height * channels;
        std::vector<io::Image> images;
        for (std::size_t i = 0; i < frames; ++i)
            images.push_back(
                io::image_from_floats({values + i * count, count}, width, height, channels));
        SPLAT_ASSIGN(const io::Buffer file, animation_of(path, images, {milliseconds, 0}));
        return io::write_file(path, file);
    });
}
