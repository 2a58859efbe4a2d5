#include <cctype>

#include "api/api_guard.h"
#include "api/core/image_view.h"
#include "eval/image_scores.h"
#include "io/animation.h"
#include "io/file.h"
#include "io/maps/number_image.h"
#include "io/npy.h"
#include "io/photo/image_file.h"

using namespace splat;

namespace {

constexpr std::uint64_t kMaxImageFileBytes = std::uint64_t{1} << 32;

/// What a file holds: an image of samples, or of float32.
struct ImageFile {
    io::Image image;  ///< size of the file; samples if they were asked for and are whole numbers
    std::vector<float> values;  ///< [height,width,channels] of a .npy or PFM
    bool floats = false;
};

Result<ImageFile> read_float_image(io::Bytes file, bool header_only) {
    // The caller makes room for what a header says.
    SPLAT_ASSIGN(
        io::NumberImage numbers,
        io::read_number_image(file, header_only ? io::NumberPart::kSize : io::NumberPart::kValues));
    ImageFile read;
    read.floats = true;
    read.image.width = numbers.width;
    read.image.height = numbers.height;
    read.image.channels = numbers.channels;
    read.image.bits = 32;
    read.values = std::move(numbers.values);
    return read;
}

Result<ImageFile> read_image_file(io::Bytes file, bool header_only) {
    if (io::is_number_image(file)) return read_float_image(file, header_only);
    ImageFile read;
    SPLAT_ASSIGN(read.image, io::read_image(file, {.upright = true, .header_only = header_only}));
    return read;
}

/// Set the sizes of a picture without pixels.
void give_image_size(const io::Image& from, splat_image& to) {
    SPLAT_COPY(to, from, width, height, channels);
    if (to.type == 0) to.type = from.bits == 8 ? SPLAT_PIXEL_U8 : SPLAT_PIXEL_F32;
    to.bytes = std::size_t{to.width} * to.height * to.channels * api::pixel_bytes(to.type);
}

Status read_into(io::Bytes file, splat_image& image, splat_image_info* info) {
    if (info != nullptr) SPLAT_TRY(api::check_fill(info, "info"));
    const bool header_only = image.pixels == nullptr;
    api::ImageView view;
    if (!header_only) {
        SPLAT_ASSIGN(view, api::image_to_fill(&image, "image"));
    } else if (image.type != 0 && api::pixel_bytes(image.type) == 0) {
        return invalid("image.type is %d, expected 0 or a SPLAT_PIXEL_ type", image.type);
    }
    SPLAT_ASSIGN(const ImageFile read, read_image_file(file, header_only));
    if (header_only) {
        give_image_size(read.image, image);
    } else if (read.floats) {
        SPLAT_TRY(api::check_image_size(view, "image", read.image.width, read.image.height,
                                        read.image.channels));
        api::fill_interleaved(view, read.values.data());
    } else {
        SPLAT_TRY(api::fill_image(view, "image", read.image));
    }
    if (info != nullptr) {
        splat_image_info filled{};
        filled.bits = read.image.bits;
        filled.focal = read.image.focal;
        api::give(filled, info);
    }
    return {};
}

/// 0 if the extension is none of these.
splat_image_format extension_format(const char* path) {
    std::string text = path;
    for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    if (text.ends_with(".png")) return SPLAT_IMAGE_PNG;
    if (text.ends_with(".npy")) return SPLAT_IMAGE_NPY;
    if (text.ends_with(".webp")) return SPLAT_IMAGE_WEBP;
    return text.ends_with(".gif") ? SPLAT_IMAGE_GIF : 0;
}

Status no_format(const char* name, const char* expected) {
    return unsupported("'%s': expected the extension %s", name, expected);
}

Status bad_format(splat_image_format format, const char* expected) {
    return invalid("format is %d, expected %s", format, expected);
}

Result<io::Buffer> image_file_of(const splat_image* image, splat_image_format format) {
    SPLAT_ASSIGN(const api::ImageView view, api::image_to_read(image, "image"));
    if (format == SPLAT_IMAGE_NPY)
        return io::write_npy({{view.height, view.width, view.channels}, api::interleaved_of(view)});
    if (format == SPLAT_IMAGE_PNG16)
        return io::write_png(io::image_from_floats(api::interleaved_of(view), view.width,
                                                   view.height, view.channels, 16));
    return io::write_png(api::image_of(view));
}

bool is_animation(splat_image_format format) {
    return format == SPLAT_IMAGE_PNG || format == SPLAT_IMAGE_GIF || format == SPLAT_IMAGE_WEBP;
}

Result<io::Buffer> animation_of(const splat_image* frames, std::uint32_t count,
                                std::uint32_t milliseconds, splat_image_format format) {
    SPLAT_TRY(api::require(frames, "frames"));
    if (count == 0) return invalid("count is 0, expected at least 1");
    std::vector<io::Image> images;
    for (std::uint32_t i = 0; i < count; ++i) {
        SPLAT_ASSIGN(const api::ImageView view,
                     api::image_to_read(frames + i, splat::format("frames[%u]", i).c_str()));
        images.push_back(api::image_of(view));
    }
    const io::AnimationOptions options{milliseconds, 0};
    if (format == SPLAT_IMAGE_WEBP) return io::write_webp_animation(images, options);
    return format == SPLAT_IMAGE_GIF ? io::write_gif(images, options)
                                     : io::write_apng(images, options);
}

}  // namespace

splat_result splat_image_load(const char* path, splat_image* image, splat_image_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path", image, "image"));
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxImageFileBytes));
        const Status read = read_into(file, *image, info);
        if (read.ok() || read.code() == Code::kInvalidArgument) return read;
        return Status(read.code(), "'" + std::string(path) + "': " + read.message());
    });
}

splat_result splat_image_load_memory(const void* data, size_t bytes, splat_image* image,
                                     splat_image_info* info) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(data, "data", image, "image"));
        return read_into({static_cast<const std::byte*>(data), bytes}, *image, info);
    });
}

splat_result splat_image_save(const char* path, const splat_image* image) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path"));
        const splat_image_format format = extension_format(path);
        if (format != SPLAT_IMAGE_PNG && format != SPLAT_IMAGE_NPY)
            return no_format(path, ".png or .npy");
        SPLAT_ASSIGN(const io::Buffer file, image_file_of(image, format));
        return io::write_file(path, file);
    });
}

splat_result splat_image_save_memory(const splat_image* image, splat_image_format format,
                                     void* buffer, size_t capacity, size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        if (format != SPLAT_IMAGE_PNG && format != SPLAT_IMAGE_NPY && format != SPLAT_IMAGE_PNG16)
            return bad_format(format, "SPLAT_IMAGE_PNG, SPLAT_IMAGE_PNG16 or SPLAT_IMAGE_NPY");
        SPLAT_ASSIGN(const io::Buffer file, image_file_of(image, format));
        return give(file);
    });
}

splat_result splat_image_save_animation(const char* path, const splat_image* frames, uint32_t count,
                                        uint32_t milliseconds) {
    return api::guarded([&]() -> Status {
        SPLAT_TRY(api::require(path, "path"));
        const splat_image_format format = extension_format(path);
        if (!is_animation(format)) return no_format(path, ".png, .gif or .webp");
        SPLAT_ASSIGN(const io::Buffer file, animation_of(frames, count, milliseconds, format));
        return io::write_file(path, file);
    });
}

splat_result splat_image_save_animation_memory(const splat_image* frames, uint32_t count,
                                               uint32_t milliseconds, splat_image_format format,
                                               void* buffer, size_t capacity, size_t* needed) {
    return api::guarded_bytes(buffer, capacity, needed, [&](auto give) -> Status {
        if (!is_animation(format))
            return bad_format(format, "SPLAT_IMAGE_PNG, SPLAT_IMAGE_GIF or SPLAT_IMAGE_WEBP");
        SPLAT_ASSIGN(const io::Buffer file, animation_of(frames, count, milliseconds, format));
        return give(file);
    });
}

splat_result splat_image_compare(const splat_image* a, const splat_image* b,
                                 splat_image_scores* scores) {
    return api::guarded([&]() -> Status {
        SPLAT_ASSIGN(const api::ImageView first, api::image_to_read(a, "a"));
        SPLAT_ASSIGN(const api::ImageView second, api::image_to_read(b, "b"));
        SPLAT_TRY(api::check_fill(scores, "scores"));
        SPLAT_TRY(api::check_image_size(second, "b", first.width, first.height, first.channels));
        SPLAT_ASSIGN(const eval::ImageScores made,
                     eval::compare_images(api::planes_of(first), api::planes_of(second),
                                          first.channels, first.height, first.width));
        splat_image_scores filled{};
        SPLAT_COPY(filled, made, squared_error, psnr, ssim);
        api::give(filled, scores);
        return {};
    });
}
