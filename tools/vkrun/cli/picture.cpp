#include "vkrun/cli/picture.h"

#include <algorithm>
#include <cmath>

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

void Picture::place(const float* planes, std::uint32_t channels, std::uint32_t width,
                    std::uint32_t height, std::uint32_t x, std::uint32_t y) {
    const std::size_t area = std::size_t{width} * height;
    for (std::uint32_t row = 0; row < height && y + row < height_; ++row)
        for (std::uint32_t column = 0; column < width && x + column < width_; ++column)
            for (std::size_t c = 0; c < 3; ++c)
                rgb_[3 * (std::size_t{y + row} * width_ + x + column) + c] =
                    planes[(channels == 1 ? 0 : c) * area + std::size_t{row} * width + column];
}

void Picture::save(const std::string& path) const {
    const splat_image image = interleaved_image(rgb_.data(), width_, height_, 3);
    check(splat_image_save(path.c_str(), &image));
}

void PhotoSheet::add(const float* truth, const float* drawn, std::uint32_t width,
                     std::uint32_t height) {
    const std::uint32_t factor = (std::max(width, height) + kMostSide - 1) / kMostSide;
    const std::uint32_t w = std::max(width / factor, 1U), h = std::max(height / factor, 1U);
    const auto reduced = [&](const float* planes) {
        Cell cell{std::vector<float>(std::size_t{3} * w * h), w, h};
        const std::uint32_t across = std::min(factor, width), down = std::min(factor, height);
        const float share = 1.0F / static_cast<float>(across * down);
        for (std::size_t i = 0; i < cell.planes.size(); ++i) {
            const std::size_t x = i % w * factor, y = i / w % h * factor,
                              c = i / (std::size_t{w} * h);
            for (std::size_t k = 0; k < std::size_t{across} * down; ++k)
                cell.planes[i] +=
                    share * planes[(c * height + y + k / across) * width + x + k % across];
        }
        return cell;
    };
    Cell error = reduced(truth);
    const Cell image = reduced(drawn);
    cells_.push_back(error);
    cells_.push_back(image);
    const std::size_t area = std::size_t{w} * h;
    for (std::size_t i = 0; i < area; ++i) {
        float* const at = &error.planes[i];
        const bool none = at[0] == 0 && at[area] == 0 && at[2 * area] == 0;
        for (std::size_t c = 0; c < 3; ++c)
            at[c * area] = none ? 1 : 1 - std::abs(at[c * area] - image.planes[c * area + i]);
    }
    cells_.push_back(std::move(error));
}

void PhotoSheet::save(const std::string& path) const {
    constexpr std::uint32_t kColumns = 6, kGap = 4;
    std::uint32_t width = 1, height = 1;
    for (const Cell& cell : cells_) {
        width = std::max(width, cell.width);
        height = std::max(height, cell.height);
    }
    const auto count = static_cast<std::uint32_t>(cells_.size());
    Picture sheet(std::min(count, kColumns) * (width + kGap) + kGap,
                  (count + kColumns - 1) / kColumns * (height + kGap) + kGap);
    for (std::uint32_t i = 0; i < count; ++i)
        sheet.place(cells_[i].planes.data(), 3, cells_[i].width, cells_[i].height,
                    kGap + i % kColumns * (width + kGap), kGap + i / kColumns * (height + kGap));
    sheet.save(path);
}

Picture contact_sheet(const std::vector<const float*>& cells, std::uint32_t side,
                      std::uint32_t columns, std::uint32_t gap) {
    const auto rows = static_cast<std::uint32_t>((cells.size() + columns - 1) / columns);
    Picture sheet(columns * (side + gap) + gap, rows * (side + gap) + gap);
    for (std::uint32_t i = 0; i < cells.size(); ++i) {
        if (cells[i] == nullptr) continue;
        sheet.place(cells[i], 3, side, side, gap + i % columns * (side + gap),
                    gap + i / columns * (side + gap));
    }
    return sheet;
}

}  // namespace vkrun
