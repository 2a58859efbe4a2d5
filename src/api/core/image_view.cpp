#include "api/core/image_view.h"

#include <algorithm>
#include <array>
#include <cstring>

#include "api/api_guard.h"
#include "core/checked_math.h"
#include "io/tensor_file.h"
#include "scene/camera_pose.h"

namespace splat::api {
namespace {

/// Calls visit(place of the sample, y, x, channel) for every sample, rows first.
template <class Visit>
void for_each_sample(const ImageView& view, Visit&& visit) {
    for (std::uint32_t y = 0; y < view.height; ++y)
        for (std::uint32_t x = 0; x < view.width; ++x) {
            std::byte* at = view.pixels + view.row_stride * std::int64_t{y} +
                            view.pixel_stride * std::int64_t{x};
            for (std::uint32_t c = 0; c < view.channels; ++c, at += view.channel_stride)
                visit(at, y, x, c);
        }
}

template <class T>
T load(const std::byte* at) {
    T value;
    std::memcpy(&value, at, sizeof value);
    return value;
}

template <class T>
void store(std::byte* at, T value) {
    std::memcpy(at, &value, sizeof value);
}

std::uint8_t byte_of(float value) {
    return io::to_byte(255 * static_cast<double>(value));
}

/// Calls visit(value, y, x, channel) with every sample as a number from 0 to 1.
template <class Visit>
void read_floats(const ImageView& view, Visit&& visit) {
    for_each_sample(view, [&](const std::byte* at, auto y, auto x, auto c) {
        float value = 0;
        if (view.type == SPLAT_PIXEL_U8)
            value = static_cast<float>(std::to_integer<int>(*at)) / 255;
        else if (view.type == SPLAT_PIXEL_F16)
            value = io::from_half(load<std::uint16_t>(at));
        else
            value = load<float>(at);
        visit(value, y, x, c);
    });
}

/// Fills every sample with the number from 0 to 1 that `value(y, x, channel)` returns.
template <class Value>
void write_floats(const ImageView& view, Value&& value) {
    for_each_sample(view, [&](std::byte* at, auto y, auto x, auto c) {
        if (view.type == SPLAT_PIXEL_U8)
            *at = std::byte{byte_of(value(y, x, c))};
        else if (view.type == SPLAT_PIXEL_F16)
            store(at, io::to_half(value(y, x, c)));
        else
            store(at, value(y, x, c));
    });
}

std::size_t interleaved_place(const ImageView& view, std::uint32_t y, std::uint32_t x,
                              std::uint32_t c) {
    return (std::size_t{y} * view.width + x) * view.channels + c;
}

std::size_t plane_place(const ImageView& view, std::uint32_t y, std::uint32_t x, std::uint32_t c) {
    return (std::size_t{c} * view.height + y) * view.width + x;
}

Status in_range(const char* argument, const char* member, std::uint32_t value, std::uint32_t most) {
    if (value >= 1 && value <= most) return {};
    return invalid("%s.%s is %u, expected 1 to %u", argument, member, value, most);
}

/// An axis of the picture: its samples, and the bytes from one to the next.
struct Axis {
    std::uint64_t count;
    std::int64_t stride;
};

/// The layout lies in `bytes`.
Status check_reach(const char* argument, const std::array<Axis, 3>& axes, std::uint64_t size,
                   std::uint64_t bytes) {
    std::uint64_t end = size;
    for (const Axis& axis : axes) {
        if (axis.stride < 0)
            return invalid("%s has the stride %lld; with a negative stride, bytes must be 0",
                           argument, lld(axis.stride));
        const auto reach = checked_mul(axis.count - 1, static_cast<std::uint64_t>(axis.stride));
        const auto sum = reach ? checked_add(end, *reach) : reach;
        if (!sum)
            return invalid("%s has the stride %lld beyond the address space", argument,
                           lld(axis.stride));
        end = *sum;
    }
    if (end <= bytes) return {};
    return invalid("%s.bytes is %llu, its size and strides take %llu", argument, llu(bytes),
                   llu(end));
}

/// Samples are distinct if, sorted by stride, each axis steps over the span of the smaller ones.
Status check_distinct(const char* argument, std::array<Axis, 3> axes, std::uint64_t size) {
    const auto step = [](const Axis& axis) {
        const auto stride = static_cast<std::uint64_t>(axis.stride);
        return axis.stride < 0 ? 0 - stride : stride;
    };
    std::ranges::sort(axes, [&](const Axis& a, const Axis& b) { return step(a) < step(b); });
    std::uint64_t span = size;
    for (const Axis& axis : axes) {
        if (axis.count == 1) continue;
        const auto reach = checked_mul(axis.count - 1, step(axis));
        const auto sum = reach ? checked_add(span, *reach) : reach;
        if (step(axis) < span || !sum)
            return invalid("%s is written to, and its strides put two samples in one place",
                           argument);
        span = *sum;
    }
    return {};
}

std::array<Axis, 3> axes_of(const ImageView& view) {
    return {{{view.height, view.row_stride},
             {view.width, view.pixel_stride},
             {view.channels, view.channel_stride}}};
}

}  // namespace

std::size_t pixel_bytes(splat_pixel type) {
    switch (type) {
        case SPLAT_PIXEL_U8:
            return 1;
        case SPLAT_PIXEL_F16:
            return 2;
        case SPLAT_PIXEL_F32:
            return 4;
        default:
            return 0;
    }
}

Result<ImageView> image_to_read(const splat_image* image, const char* argument) {
    SPLAT_TRY(require(image, argument));
    if (image->pixels == nullptr) return invalid("%s.pixels is NULL", argument);
    const std::size_t size = pixel_bytes(image->type);
    if (size == 0)
        return invalid("%s.type is %d, expected a SPLAT_PIXEL_ type", argument, image->type);
    SPLAT_TRY(in_range(argument, "width", image->width, scene::kMaxImageSide));
    SPLAT_TRY(in_range(argument, "height", image->height, scene::kMaxImageSide));
    SPLAT_TRY(in_range(argument, "channels", image->channels, 4));
    ImageView view{static_cast<std::byte*>(image->pixels),
                   image->type,
                   image->width,
                   image->height,
                   image->channels,
                   image->row_stride,
                   image->pixel_stride,
                   image->channel_stride};
    if (view.pixel_stride == 0 && view.channel_stride == 0) {
        view.channel_stride = static_cast<std::int64_t>(size);
        view.pixel_stride = view.channel_stride * view.channels;
        if (view.row_stride == 0) view.row_stride = view.pixel_stride * view.width;
    }
    if (image->bytes != 0) SPLAT_TRY(check_reach(argument, axes_of(view), size, image->bytes));
    return view;
}

Result<ImageView> image_to_fill(const splat_image* image, const char* argument) {
    SPLAT_ASSIGN(const ImageView view, image_to_read(image, argument));
    SPLAT_TRY(check_distinct(argument, axes_of(view), pixel_bytes(view.type)));
    return view;
}

Status check_image_size(const ImageView& view, const char* argument, std::uint32_t width,
                        std::uint32_t height, std::uint32_t channels) {
    if (view.width == width && view.height == height && view.channels == channels) return {};
    return error(Code::kShape, "%s is %u x %u pixels of %u channels, expected %u x %u of %u",
                 argument, view.width, view.height, view.channels, width, height, channels);
}

std::vector<float> planes_of(const ImageView& view) {
    std::vector<float> planes(view.samples());
    read_floats(view, [&](float value, auto y, auto x, auto c) {
        planes[plane_place(view, y, x, c)] = value;
    });
    return planes;
}

std::vector<float> interleaved_of(const ImageView& view) {
    std::vector<float> values(view.samples());
    read_floats(view, [&](float value, auto y, auto x, auto c) {
        values[interleaved_place(view, y, x, c)] = value;
    });
    return values;
}

void fill_planes(const ImageView& view, const float* planes) {
    write_floats(view, [&](auto y, auto x, auto c) { return planes[plane_place(view, y, x, c)]; });
}

void fill_interleaved(const ImageView& view, const float* values) {
    fill_pixels(view, values, view.channels);
}

void fill_pixels(const ImageView& view, const float* values, std::size_t stride) {
    write_floats(view, [&](auto y, auto x, auto c) {
        return values[(std::size_t{y} * view.width + x) * stride + c];
    });
}

io::Image image_of(const ImageView& view) {
    io::Image image{view.width, view.height, view.channels, 8, {}};
    image.samples.reserve(view.samples());
    if (view.type == SPLAT_PIXEL_U8)
        for_each_sample(view, [&](const std::byte* at, auto, auto, auto) {
            image.samples.push_back(std::to_integer<std::uint16_t>(*at));
        });
    else
        read_floats(
            view, [&](float value, auto, auto, auto) { image.samples.push_back(byte_of(value)); });
    return image;
}

Status fill_image(const ImageView& view, const char* argument, const io::Image& image) {
    const bool alpha = image.channels == 2 || image.channels == 4;
    const bool gray = image.channels < 3;
    if (view.width != image.width || view.height != image.height ||
        view.channels < image.channels || (alpha && view.channels % 2 != 0))
        return error(Code::kShape,
                     "%s is %u x %u pixels of %u channels, the image is %u x %u of %u", argument,
                     view.width, view.height, view.channels, image.width, image.height,
                     image.channels);
    const std::uint32_t most = image.bits == 16 ? 65535 : 255;
    const auto sample = [&](std::uint32_t y, std::uint32_t x, std::uint32_t c) -> std::uint32_t {
        const std::size_t pixel = (std::size_t{y} * image.width + x) * image.channels;
        const bool is_alpha = c + 1 == view.channels && view.channels % 2 == 0;
        if (is_alpha) return alpha ? image.samples[pixel + image.channels - 1] : most;
        return image.samples[pixel + (gray ? 0 : c)];
    };
    if (view.type == SPLAT_PIXEL_U8)
        for_each_sample(view, [&](std::byte* at, auto y, auto x, auto c) {
            const std::uint32_t value = sample(y, x, c);
            *at = static_cast<std::byte>(most == 255 ? value : (value + 128) / 257);
        });
    else
        write_floats(view, [&](auto y, auto x, auto c) {
            return static_cast<float>(sample(y, x, c)) / static_cast<float>(most);
        });
    return {};
}

}  // namespace splat::api
