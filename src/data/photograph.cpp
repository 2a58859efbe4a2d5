#include "data/photograph.h"

#include <algorithm>
#include <cmath>

#include "data/resample.h"
#include "io/photo/image_file.h"

namespace splat::data {
namespace {

constexpr int kBorderTolerance = 26;  ///< levels of 255, in every channel
constexpr double kLeastObject = 0.01, kMostObject = 0.95;

struct Box {
    std::int64_t left = 0, top = 0, right = 0, bottom = 0;  ///< right and bottom are outside
};

/// The image in 8 bits: itself, or a reduced copy in `reduced`.
const io::Image& eight_bits(const io::Image& image, io::Image& reduced) {
    if (image.bits == 8) return image;
    reduced = image;
    for (std::uint16_t& sample : reduced.samples)
        sample = static_cast<std::uint16_t>((sample + 128) / 257);  // the nearest of v / 255
    reduced.bits = 8;
    return reduced;
}

Status check_map(const NamedImage& map, const io::Image& like) {
    if (map.image.width == like.width && map.image.height == like.height) return {};
    return invalid("%s is %u x %u pixels, expected the image's %u x %u", map.name.c_str(),
                   map.image.width, map.image.height, like.width, like.height);
}

/// One channel of every pixel; gray images have it in all channels.
std::uint16_t sample(const io::Image& image, std::size_t pixel, std::uint32_t channel) {
    const bool gray = image.channels < 3;
    return image.samples[pixel * image.channels + (gray ? 0 : channel)];
}

/// True if an alpha leaves something out; a screenshot has 255 everywhere.
bool has_alpha(const io::Image& image) {
    if (image.channels != 2 && image.channels != 4) return false;
    for (std::size_t i = image.channels - 1; i < image.samples.size(); i += image.channels)
        if (image.samples[i] <= 127) return true;
    return false;
}

/// Pixels that are joined to the border by colours like the border's median are background.
std::vector<std::uint8_t> flooded_mask(const io::Image& image) {
    const std::size_t w = image.width, h = image.height;
    std::vector<std::size_t> open;
    for (std::size_t x = 0; x < w; ++x) open.insert(open.end(), {x, (h - 1) * w + x});
    for (std::size_t y = 0; y < h; ++y) open.insert(open.end(), {y * w, y * w + w - 1});
    std::array<int, 3> median{};
    for (std::uint32_t c = 0; c < 3; ++c) {
        std::vector<std::uint16_t> values;
        for (const std::size_t pixel : open) values.push_back(sample(image, pixel, c));
        const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
        std::nth_element(values.begin(), middle, values.end());
        median[c] = *middle;
    }
    std::vector<std::uint8_t> mask(w * h, 255);
    const auto visit = [&](std::size_t pixel) {
        for (std::uint32_t c = 0; c < 3; ++c)
            if (std::abs(sample(image, pixel, c) - median[c]) > kBorderTolerance) return false;
        mask[pixel] = 0;
        return true;
    };
    std::erase_if(open, [&](std::size_t pixel) { return mask[pixel] == 0 || !visit(pixel); });
    while (!open.empty()) {
        const std::size_t pixel = open.back();
        open.pop_back();
        const std::size_t x = pixel % w, y = pixel / w;
        const auto next = [&](bool inside, std::size_t other) {
            if (inside && mask[other] != 0 && visit(other)) open.push_back(other);
        };
        next(x > 0, pixel - 1);
        next(x + 1 < w, pixel + 1);
        next(y > 0, pixel - w);
        next(y + 1 < h, pixel + w);
    }
    return mask;
}

/// The object's mask, 0 to 255, and where it comes from.
Result<std::vector<std::uint8_t>> object_mask(const std::optional<NamedImage>& given,
                                              const io::Image& image, bool flood, MaskFrom& from) {
    const std::size_t pixels = std::size_t{image.width} * image.height;
    std::vector<std::uint8_t> mask(pixels, 255);
    if (given) {
        SPLAT_TRY(check_map(*given, image));
        io::Image reduced;
        const io::Image& file = eight_bits(given->image, reduced);
        for (std::size_t i = 0; i < pixels; ++i)
            mask[i] = static_cast<std::uint8_t>(sample(file, i, 0));
        from = MaskFrom::kMask;
    } else if (has_alpha(image)) {
        for (std::size_t i = 0; i < pixels; ++i)
            mask[i] =
                static_cast<std::uint8_t>(image.samples[i * image.channels + image.channels - 1]);
        from = MaskFrom::kAlpha;
    } else if (flood) {
        mask = flooded_mask(image);
        from = MaskFrom::kBorder;
    } else {
        from = MaskFrom::kNothing;
        return mask;
    }
    const auto count =
        static_cast<double>(std::ranges::count_if(mask, [](std::uint8_t m) { return m > 127; }));
    const double part = count / static_cast<double>(pixels);
    if (!given && (part < kLeastObject || part > kMostObject)) {
        std::ranges::fill(mask, std::uint8_t{255});
        from = MaskFrom::kNothing;
    } else if (count == 0) {
        const bool of_ones = *std::ranges::max_element(mask) == 1;
        return invalid("%s: the mask has no pixel above one half%s", given->name.c_str(),
                       of_ones
                           ? "; its largest value is 1 of 255, and 255 means inside: multiply a "
                             "mask of 0 and 1 by 255"
                           : "");
    }
    return mask;
}

Box bounds_of(const std::vector<std::uint8_t>& mask, std::int64_t width, std::int64_t height) {
    Box box{width, height, 0, 0};
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t x = 0; x < width; ++x) {
            if (mask[static_cast<std::size_t>(y * width + x)] <= 127) continue;
            box.left = std::min(box.left, x);
            box.right = std::max(box.right, x + 1);
            box.top = std::min(box.top, y);
            box.bottom = std::max(box.bottom, y + 1);
        }
    return box;
}

/// The square of the picture that becomes the image.
struct Square {
    std::int64_t left = 0, top = 0, side = 0;
};

Square square_of(const CutOptions& options, const Box& box, const io::Image& image) {
    const auto width = static_cast<std::int64_t>(image.width);
    const auto height = static_cast<std::int64_t>(image.height);
    if (!options.crop) {
        const std::int64_t side = std::min(width, height);
        return {(width - side) / 2, (height - side) / 2, side};
    }
    const std::int64_t longer = std::max(box.right - box.left, box.bottom - box.top);
    const auto side =
        static_cast<std::int64_t>(std::lround(static_cast<double>(longer) / options.foreground));
    return {(box.left + box.right - side) / 2, (box.top + box.bottom - side) / 2, side};
}

/// Channels `first` to `first + count` of a square of an image, scaled to [count,R,R] from 0 to 1; outside
/// of the image `fill` is used, and behind the mask in proportion.
Result<std::vector<float>> cut(const io::Image& image, const std::vector<std::uint8_t>* mask,
                               const Square& square, std::uint32_t count, std::uint32_t resolution,
                               const std::array<float, 3>& fill) {
    io::Image part;
    part.width = part.height = static_cast<std::uint32_t>(square.side);
    part.channels = 4;
    part.samples.assign(std::size_t{4} * part.width * part.height, 0);
    for (std::int64_t y = 0; y < square.side; ++y)
        for (std::int64_t x = 0; x < square.side; ++x) {
            const std::int64_t column = square.left + x, row = square.top + y;
            if (column < 0 || row < 0 || column >= image.width || row >= image.height) continue;
            const auto from = static_cast<std::size_t>(row * image.width + column);
            const auto to = static_cast<std::size_t>(4 * (y * square.side + x));
            for (std::uint32_t c = 0; c < 3; ++c) part.samples[to + c] = sample(image, from, c);
            part.samples[to + 3] = mask == nullptr ? 255 : (*mask)[from];
        }
    SPLAT_ASSIGN(const io::Image scaled, resample(part, resolution, resolution, Filter::kLanczos));
    const std::size_t pixels = std::size_t{resolution} * resolution;
    std::vector<float> planes(count * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
        const float alpha = static_cast<float>(scaled.samples[4 * i + 3]) / 255;
        for (std::size_t c = 0; c < count; ++c)
            planes[c * pixels + i] =
                alpha * static_cast<float>(scaled.samples[4 * i + c]) / 255 + (1 - alpha) * fill[c];
    }
    return planes;
}

/// The same of a map; empty without one.
Result<std::vector<float>> cut_map(const std::optional<NamedImage>& map, const io::Image& like,
                                   const std::vector<std::uint8_t>& mask, const Square& square,
                                   std::uint32_t count, std::uint32_t resolution,
                                   const std::array<float, 3>& fill) {
    if (!map) return std::vector<float>();
    SPLAT_TRY(check_map(*map, like));
    io::Image reduced;
    return cut(eight_bits(map->image, reduced), &mask, square, count, resolution, fill);
}

}  // namespace

const char* mask_from_name(MaskFrom from) {
    constexpr const char* kNames[] = {"mask", "alpha", "border", "nothing"};
    return kNames[static_cast<int>(from) - 1];
}

Result<std::vector<std::uint8_t>> mask_of(const io::Image& image, MaskFrom& from) {
    io::Image reduced;
    return object_mask(std::nullopt, eight_bits(image, reduced), true, from);
}

Result<NamedImage> load_picture(const std::string& path) {
    SPLAT_ASSIGN(io::Image image, io::load_image(path, {.upright = true}));
    return NamedImage{std::move(image), "'" + path + "'", {}};
}

Result<Photograph> cut_photograph(const Picture& picture, const CutOptions& options) {
    if (!(options.foreground > 0.05 && options.foreground <= 1))
        return invalid("foreground is %g, expected more than 0.05, at most 1", options.foreground);
    io::Image reduced;
    const io::Image& image = eight_bits(picture.image.image, reduced);
    Photograph made;
    made.width = image.width;
    made.height = image.height;
    SPLAT_ASSIGN(const std::vector<std::uint8_t> mask,
                 object_mask(picture.mask, image, options.flood, made.mask_from));
    const Box box = bounds_of(mask, image.width, image.height);
    made.at_border =
        made.mask_from != MaskFrom::kNothing &&
        (box.left == 0 || box.top == 0 || box.right == image.width || box.bottom == image.height);
    const Square square = square_of(options, box, image);
    made.x = static_cast<double>(square.left);
    made.y = static_cast<double>(square.top);
    made.side = static_cast<double>(square.side);
    const std::uint32_t side = options.resolution;
    SPLAT_ASSIGN(made.image, cut(image, &mask, square, 3, side, options.background));
    io::Image white = image;
    std::ranges::fill(white.samples, std::uint16_t{255});
    SPLAT_ASSIGN(made.mask, cut(white, &mask, square, 1, side, {}));
    // Outside of the object: depth 0 is farthest, a normal of 0 is 0.5 in every channel.
    if (options.depth)
        SPLAT_SET(made.depth, cut_map(picture.depth, image, mask, square, 1, side, {}));
    SPLAT_ASSIGN(made.normal,
                 cut_map(picture.normal, image, mask, square, 3, side, {0.5F, 0.5F, 0.5F}));
    return made;
}

}  // namespace splat::data
