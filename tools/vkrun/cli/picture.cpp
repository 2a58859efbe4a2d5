#include "vkrun/cli/picture.h"

#include "vkrun/cli/handles.h"

namespace vkrun {

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
    check(splat_image_save(path.c_str(), rgb_.data(), width_, height_, 3));
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
