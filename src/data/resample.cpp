#include "data/resample.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace splat::data {
namespace {

constexpr int kWeightBits = 22;

double sinc(double x) {
    return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

double kernel(Filter filter, double x) {
    constexpr double a = -0.5;
    const double d = std::abs(x);
    switch (filter) {
        case Filter::kBox:
            return x > -0.5 && x <= 0.5 ? 1 : 0;
        case Filter::kBilinear:
            return d < 1 ? 1 - d : 0;
        case Filter::kBicubic:
            if (d < 1) return ((a + 2) * d - (a + 3)) * d * d + 1;
            return d < 2 ? (((d - 5) * d + 8) * d - 4) * a : 0;
        case Filter::kLanczos:
            break;
    }
    return x >= -3 && x < 3 ? sinc(x) * sinc(x / 3) : 0;
}

double support_of(Filter filter) {
    constexpr double kSupports[] = {0.5, 1, 2, 3};
    return kSupports[static_cast<std::size_t>(filter)];
}

/// The samples that contribute to one new sample.
struct Taps {
    std::size_t first = 0;
    std::vector<std::int32_t> weights;
};

std::vector<Taps> taps_of(std::uint32_t from, std::uint32_t to, Filter filter) {
    const double scale = static_cast<double>(from) / to;
    const double widened = std::max(scale, 1.0);
    const double support = support_of(filter) * widened;
    std::vector<Taps> all(to);
    for (std::uint32_t i = 0; i < to; ++i) {
        const double center = (i + 0.5) * scale;
        const auto first = static_cast<std::size_t>(std::max(0.0, center - support + 0.5));
        const auto end =
            std::min<std::size_t>(from, static_cast<std::size_t>(center + support + 0.5));
        std::vector<double> exact;
        double sum = 0;
        for (std::size_t k = first; k < end; ++k) {
            exact.push_back(
                kernel(filter, (static_cast<double>(k) - center + 0.5) * (1 / widened)));
            sum += exact.back();
        }
        all[i].first = first;
        for (const double w : exact) {
            const double scaled = (sum != 0 ? w * (1 / sum) : w) * (1 << kWeightBits);
            all[i].weights.push_back(
                static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5));
        }
    }
    return all;
}

/// Resample lines of samples that are `step` apart; the lines start at `base`.
void resample_line(const std::uint16_t* base, std::size_t step, const std::vector<Taps>& taps,
                   std::uint16_t* out, std::size_t out_step) {
    for (std::size_t i = 0; i < taps.size(); ++i) {
        std::int64_t sum = 1 << (kWeightBits - 1);
        for (std::size_t k = 0; k < taps[i].weights.size(); ++k)
            sum += std::int64_t{taps[i].weights[k]} * base[(taps[i].first + k) * step];
        out[i * out_step] =
            static_cast<std::uint16_t>(std::clamp<std::int64_t>(sum >> kWeightBits, 0, 255));
    }
}

io::Image across(const io::Image& image, std::uint32_t width, Filter filter) {
    io::Image out{width, image.height, image.channels, 8, {}};
    out.samples.resize(std::size_t{width} * image.height * image.channels);
    const std::vector<Taps> taps = taps_of(image.width, width, filter);
    for (std::size_t y = 0; y < image.height; ++y)
        for (std::size_t c = 0; c < image.channels; ++c)
            resample_line(&image.samples[y * image.width * image.channels + c], image.channels,
                          taps, &out.samples[y * width * image.channels + c], image.channels);
    return out;
}

io::Image down(const io::Image& image, std::uint32_t height, Filter filter) {
    io::Image out{image.width, height, image.channels, 8, {}};
    const std::size_t row = std::size_t{image.width} * image.channels;
    out.samples.resize(row * height);
    const std::vector<Taps> taps = taps_of(image.height, height, filter);
    for (std::size_t x = 0; x < row; ++x)
        resample_line(&image.samples[x], row, taps, &out.samples[x], row);
    return out;
}

/// Multiplies colours by alpha, rounded, or divides them by it.
void multiply_alpha(io::Image& image) {
    const std::size_t n = image.channels;
    for (std::size_t i = 0; i < image.samples.size(); i += n)
        for (std::size_t c = 0; c + 1 < n; ++c) {
            const std::uint32_t t =
                std::uint32_t{image.samples[i + c]} * image.samples[i + n - 1] + 128U;
            image.samples[i + c] = static_cast<std::uint16_t>(((t >> 8) + t) >> 8);
        }
}

void divide_alpha(io::Image& image) {
    const std::size_t n = image.channels;
    for (std::size_t i = 0; i < image.samples.size(); i += n) {
        const std::uint32_t alpha = image.samples[i + n - 1];
        if (alpha == 0 || alpha == 255) continue;
        for (std::size_t c = 0; c + 1 < n; ++c)
            image.samples[i + c] =
                static_cast<std::uint16_t>(std::min(255U, 255U * image.samples[i + c] / alpha));
    }
}

}  // namespace

Result<io::Image> resample(const io::Image& image, std::uint32_t width, std::uint32_t height,
                           Filter filter) {
    SPLAT_TRY(io::check_image(image));
    if (image.bits != 8)
        return error(Code::kInvalidArgument, "an image of %u bits to resample, expected 8",
                     image.bits);
    if (width == 0 || height == 0)
        return error(Code::kInvalidArgument, "a size of %u x %u pixels, expected 1 x 1 or more",
                     width, height);
    if (width == image.width && height == image.height) return image;
    const bool alpha = image.channels == 2 || image.channels == 4;
    io::Image out = image;
    if (alpha) multiply_alpha(out);
    if (width != out.width) out = across(out, width, filter);
    if (height != out.height) out = down(out, height, filter);
    if (alpha) divide_alpha(out);
    return out;
}

}  // namespace splat::data
