#include "vkrun/cli/picture.h"

#include "vkrun/cli/handles.h"

namespace vkrun {

splat_image interleaved_image(const float* values, std::uint32_t width, std::uint32_t height,
                              std::uint32_t channels) {
    splat_image image{};
    image.pixels = const_cast<float*>(values);  // NOLINT(cppcoreguidelines-pro-type-const-cast)
    image.bytes = std::size_t{width} * height * channels * sizeof(float);
    image.type = SPLAT_PIXEL_F32;
    image.width = width;
    image.height = height;
    image.channels = channels;
    return image;
}

splat_image bytes_image(std::uint8_t* bytes, std::uint32_t width, std::uint32_t height,
                        std::uint32_t channels) {
    splat_image image{};
    image.pixels = bytes;
    image.bytes = std::size_t{width} * height * channels;
    image.type = SPLAT_PIXEL_U8;
    image.width = width;
    image.height = height;
    image.channels = channels;
    return image;
}

splat_image planar_image(const float* planes, std::uint32_t side, std::uint32_t channels) {
    splat_image image = interleaved_image(planes, side, side, channels);
    image.pixel_stride = sizeof(float);
    image.row_stride = image.pixel_stride * side;
    image.channel_stride = image.row_stride * side;
    return image;
}

void Picture::place(const float* planes, std::uint32_t channels, std::uint32_t side,
                    std::uint32_t x, std::uint32_t y) {
    const std::size_t area = std::size_t{side} * side;
    for (std::uint32_t row = 0; row < side && y + row < height_; ++row)
        for (std::uint32_t column = 0; column < side && x + column < width_; ++column)
            for (std::size_t c = 0; c < 3; ++c)
                rgb_[3 * (std::size_t{y + row} * width_ + x + column) + c] =
                    planes[(channels == 1 ? 0 : c) * area + std::size_t{row} * side + column];
}

void Picture::save(const std::string& path) const {
    const splat_image image = interleaved_image(rgb_.data(), width_, height_, 3);
    check(splat_image_save(path.c_str(), &image));
}

Picture contact_sheet(const std::vector<const float*>& cells, std::uint32_t side,
                      std::uint32_t columns, std::uint32_t gap) {
    const auto rows = static_cast<std::uint32_t>((cells.size() + columns - 1) / columns);
    Picture sheet(columns * (side + gap) + gap, rows * (side + gap) + gap);
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
        if (cells[i] == nullptr) continue;
        sheet.place(cells[i], 3, side, gap + i % columns * (side + gap),
                    gap + i / columns * (side + gap));
    }
    return sheet;
}

}  // namespace vkrun
