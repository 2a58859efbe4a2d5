#include "data/co3d_image.h"

#include <algorithm>
#include <cmath>

#include "data/resample.h"

namespace splat::data {
namespace {

constexpr double kLoadedSide = 800;  ///< side of the images in PyTorch3D's loader
constexpr float kBoxThreshold = 0.4F;
constexpr float kThresholdStep = 0.05F;
constexpr float kBoxContext = 0.3F;
constexpr double kRoundingMargin =
    1e-4;  ///< levels of 255: below half of one, above rounding errors

/// torch's nearest neighbour: floor(i * from / to), in float32.
std::size_t nearest(std::size_t i, std::uint32_t from, std::uint32_t to) {
    const float scale = static_cast<float>(from) / static_cast<float>(to);
    return std::min<std::size_t>(
        static_cast<std::size_t>(std::floor(static_cast<float>(i) * scale)), from - 1);
}

Planes resized_nearest(const Planes& image, std::uint32_t width, std::uint32_t height) {
    Planes out{width, height, image.channels, {}};
    for (std::uint32_t c = 0; c < image.channels; ++c)
        for (std::size_t y = 0; y < height; ++y)
            for (std::size_t x = 0; x < width; ++x)
                out.values.push_back(
                    image.at(c, nearest(y, image.height, height), nearest(x, image.width, width)));
    return out;
}

/// The two neighbours of a place between samples, and the weight of the second.
struct Between {
    std::size_t first = 0, second = 0;
    double weight = 0;
};

std::vector<Between> bilinear_taps(std::uint32_t from, std::uint32_t to) {
    std::vector<Between> taps;
    for (std::uint32_t i = 0; i < to; ++i) {
        const double place = std::max(0.0, (i + 0.5) * from / to - 0.5);
        const auto first = std::min<std::size_t>(static_cast<std::size_t>(place), from - 1);
        taps.push_back({first, std::min<std::size_t>(first + 1, from - 1),
                        place - static_cast<double>(first)});
    }
    return taps;
}

}  // namespace

Planes planes_of(const io::Image& image) {
    Planes out{image.width, image.height, image.channels, {}};
    for (std::uint32_t c = 0; c < image.channels; ++c)
        for (std::size_t i = c; i < image.samples.size(); i += image.channels)
            out.values.push_back(static_cast<float>(image.samples[i]) / 255.0F);
    return out;
}

std::array<float, 4> foreground_box(const Planes& mask) {
    for (float threshold = kBoxThreshold;; threshold -= kThresholdStep) {
        std::size_t left = mask.width, right = 0, top = mask.height, bottom = 0, count = 0;
        for (std::size_t y = 0; y < mask.height; ++y)
            for (std::size_t x = 0; x < mask.width; ++x) {
                if (!(mask.at(0, y, x) > threshold)) continue;
                ++count;
                left = std::min(left, x);
                right = std::max(right, x + 1);
                top = std::min(top, y);
                bottom = std::max(bottom, y + 1);
            }
        if (count > 1 || threshold < -1)
            return {static_cast<float>(left), static_cast<float>(top),
                    static_cast<float>(right) - static_cast<float>(left),
                    static_cast<float>(bottom) - static_cast<float>(top)};
    }
}

Result<PixelBox> crop_box(const std::array<float, 4>& box, std::uint32_t width,
                          std::uint32_t height) {
    const std::uint32_t sides[] = {width, height};
    std::uint32_t starts[2], ends[2];
    for (std::size_t i = 0; i < 2; ++i) {
        const float start = box[i] - box[i + 2] * kBoxContext / 2;
        const float side = box[i + 2] + box[i + 2] * kBoxContext;
        if (!(side > 1))
            return damaged("the box of the foreground is %g x %g, expected more than a pixel",
                           static_cast<double>(box[2]), static_cast<double>(box[3]));
        const auto most = static_cast<float>(sides[i]);
        const float end = start + std::max(side, 2.0F);
        starts[i] = static_cast<std::uint32_t>(std::nearbyint(std::clamp(start, 0.0F, most)));
        ends[i] = static_cast<std::uint32_t>(std::nearbyint(std::clamp(end, 0.0F, most)));
        if (ends[i] <= starts[i])
            return damaged("the box of the foreground lies outside the image");
    }
    return PixelBox{starts[0], starts[1], ends[0] - starts[0], ends[1] - starts[1]};
}

Planes resized_bilinear(const Planes& image, std::uint32_t width, std::uint32_t height) {
    const std::vector<Between> columns = bilinear_taps(image.width, width);
    const std::vector<Between> rows = bilinear_taps(image.height, height);
    Planes out{width, height, image.channels, {}};
    out.values.reserve(std::size_t{width} * height * image.channels);
    for (std::uint32_t c = 0; c < image.channels; ++c)
        for (const Between& row : rows)
            for (const Between& column : columns) {
                const auto across = [&](std::size_t y) {
                    return (1 - column.weight) * static_cast<double>(image.at(c, y, column.first)) +
                           column.weight * static_cast<double>(image.at(c, y, column.second));
                };
                out.values.push_back(static_cast<float>((1 - row.weight) * across(row.first) +
                                                        row.weight * across(row.second)));
            }
    return out;
}

Planes mapped_back(const Planes& mask, const PixelBox& box) {
    Planes cropped{box.width, box.height, 1, {}};
    for (std::size_t y = 0; y < box.height; ++y)
        for (std::size_t x = 0; x < box.width; ++x)
            cropped.values.push_back(mask.at(0, box.top + y, box.left + x));
    const double scale = std::min(kLoadedSide / box.height, kLoadedSide / box.width);
    const auto side = [scale](std::uint32_t pixels) {
        return std::max(1U, static_cast<std::uint32_t>(std::floor(pixels * scale)));
    };
    const Planes loaded = resized_nearest(cropped, side(box.width), side(box.height));
    const Planes back = resized_bilinear(loaded, box.width, box.height);
    Planes out{mask.width, mask.height, 1, {}};
    out.values.resize(std::size_t{mask.width} * mask.height);
    for (std::size_t y = 0; y < box.height; ++y)
        for (std::size_t x = 0; x < box.width; ++x)
            out.values[(box.top + y) * mask.width + box.left + x] = back.at(0, y, x);
    return out;
}

Result<PrincipalSquare> principal_square(const std::array<double, 2>& point, std::uint32_t width,
                                         std::uint32_t height) {
    PrincipalSquare square{point[0], point[1], 0};
    square.half_side = std::min({point[0], width - point[0], point[1], height - point[1]});
    if (square.half_side >= 0.5) return square;
    return damaged("the principal point %g, %g is not inside the image of %u x %u pixels", point[0],
                   point[1], width, height);
}

Planes sampled_square(const Planes& image, const PrincipalSquare& square) {
    const auto n = static_cast<std::uint32_t>(std::floor(2 * square.half_side));
    const double margin = 0.5 / n;
    const auto places = [&](double center, std::uint32_t limit) {
        std::vector<std::pair<std::ptrdiff_t, double>>
            taps;  // the first neighbour, weight of the second
        const double start = center - square.half_side + margin;
        const double step = n > 1 ? 2 * (square.half_side - margin) / (n - 1) : 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            const double place = start + i * step - 0.5;
            const double first = std::clamp(std::floor(place), -1.0, double{1} * limit);
            taps.emplace_back(static_cast<std::ptrdiff_t>(first), place - first);
        }
        return taps;
    };
    const auto columns = places(square.x, image.width);
    const auto rows = places(square.y, image.height);
    Planes out{n, n, image.channels, {}};
    out.values.reserve(std::size_t{n} * n * image.channels);
    for (std::uint32_t c = 0; c < image.channels; ++c) {
        const auto value = [&](std::ptrdiff_t y, std::ptrdiff_t x) {
            const bool inside = y >= 0 && x >= 0 && y < std::ptrdiff_t{image.height} &&
                                x < std::ptrdiff_t{image.width};
            return inside ? static_cast<double>(image.at(c, static_cast<std::size_t>(y),
                                                         static_cast<std::size_t>(x)))
                          : 0.0;
        };
        for (const auto& [y, down] : rows)
            for (const auto& [x, right] : columns)
                out.values.push_back(static_cast<float>(
                    (1 - down) * ((1 - right) * value(y, x) + right * value(y, x + 1)) +
                    down * ((1 - right) * value(y + 1, x) + right * value(y + 1, x + 1))));
    }
    return out;
}

Result<PreparedFrame> prepare_frame(const io::Image& image, const Planes& mask, const PixelBox& box,
                                    const PrincipalSquare& square, std::uint32_t size) {
    const Planes rgb = sampled_square(planes_of(image), square);
    io::Image bytes{rgb.width, rgb.height, 3, 8, {}};
    for (std::size_t y = 0; y < rgb.height; ++y)
        for (std::size_t x = 0; x < rgb.width; ++x)
            for (std::uint32_t c = 0; c < 3; ++c)
                bytes.samples.push_back(static_cast<std::uint16_t>(
                    255 * static_cast<double>(rgb.at(c, y, x)) + kRoundingMargin));
    SPLAT_ASSIGN(const io::Image small, resample(bytes, size, size, Filter::kLanczos));
    PreparedFrame frame;
    frame.full = planes_of(small).values;
    frame.mask =
        resized_bilinear(sampled_square(mapped_back(mask, box), square), size, size).values;
    const std::size_t area = std::size_t{size} * size;
    for (std::size_t i = 0; i < frame.full.size(); ++i)
        frame.foreground.push_back(frame.full[i] * frame.mask[i % area]);
    return frame;
}

}  // namespace splat::data
