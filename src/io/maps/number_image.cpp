#include "io/maps/number_image.h"

#include "io/maps/netpbm.h"
#include "io/npy.h"
#include "io/photo/image_file.h"
#include "scene/camera_pose.h"

namespace splat::io {
namespace {

constexpr std::uint64_t kMostChannels = 4;

bool is_npy(Bytes file) {
    return as_text(file).starts_with("\x93NUMPY");
}

bool is_channels(std::uint64_t size) {
    return size >= 1 && size <= kMostChannels;
}

/// The axes are channels, height, width.
bool is_planar(const std::vector<std::uint64_t>& shape) {
    return shape.size() == 3 && is_channels(shape[0]) && !is_channels(shape[2]);
}

Status refuse_shape(const std::vector<std::uint64_t>& shape) {
    std::string text;
    for (const std::uint64_t size : shape) text += (text.empty() ? "" : ",") + std::to_string(size);
    return unsupported(
        "npy: an array [%s], expected [height,width], [height,width,channels] or "
        "[channels,height,width] of 1 to %u pixels a side and 1 to 4 channels",
        text.c_str(), scene::kMaxImageSide);
}

Result<NumberImage> npy_size(const NpyHeader& header) {
    const std::vector<std::uint64_t>& shape = header.shape;
    if (shape.size() != 2 && shape.size() != 3) return refuse_shape(shape);
    const bool planar = is_planar(shape);
    const std::uint64_t height = shape[planar ? 1 : 0], width = shape[planar ? 2 : 1];
    const std::uint64_t channels = shape.size() == 2 ? 1 : shape[planar ? 0 : 2];
    for (const std::uint64_t side : {height, width})
        if (side < 1 || side > scene::kMaxImageSide || !is_channels(channels))
            return refuse_shape(shape);
    NumberImage image;
    image.width = static_cast<std::uint32_t>(width);
    image.height = static_cast<std::uint32_t>(height);
    image.channels = static_cast<std::uint32_t>(channels);
    if (header.dtype == "u1" || header.dtype == "b1")
        image.bits = 8;
    else if (!header.dtype.starts_with('f'))
        image.bits = 16;
    return image;
}

/// [channels,pixels] to [pixels,channels].
std::vector<float> interleaved(const std::vector<float>& planes, std::size_t channels) {
    const std::size_t pixels = planes.size() / channels;
    std::vector<float> values;
    values.reserve(planes.size());
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < channels; ++c) values.push_back(planes[c * pixels + i]);
    return values;
}

Result<NumberImage> read_npy_image(Bytes file, NumberPart part) {
    SPLAT_ASSIGN(const NpyHeader header, read_npy_header(file));
    if (part == NumberPart::kSize) SPLAT_TRY(npy_data(file, header).status());
    SPLAT_ASSIGN(NumberImage image, npy_size(header));
    if (part != NumberPart::kValues) return image;
    SPLAT_ASSIGN(FloatArray array, read_npy(file));
    image.values = is_planar(header.shape) ? interleaved(array.values, image.channels)
                                           : std::move(array.values);
    return image;
}

}  // namespace

bool is_number_name(const std::string& path) {
    return has_extension(path, {".npy", ".pfm"});
}

bool is_number_image(Bytes file) {
    return is_npy(file) || as_text(file).starts_with("PF") || as_text(file).starts_with("Pf");
}

Result<NumberImage> read_number_image(Bytes file, NumberPart part) {
    return is_npy(file) ? read_npy_image(file, part) : read_pfm(file, part);
}

}  // namespace splat::io
