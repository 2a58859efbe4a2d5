#include "data/resample.h"

#include <algorithm>

#include "data/resample_taps.h"

namespace splat::data {
namespace {

constexpr int kWeightBits = 22;

/// The same taps in fixed point.
struct FixedTaps {
    std::size_t first = 0;
    std::vector<std::int32_t> weights;
};

std::vector<FixedTaps> fixed_taps(std::uint32_t from, std::uint32_t to, Filter filter) {
    std::vector<FixedTaps> all;
    for (const Taps& exact : pillow_taps(from, to, filter)) {
        FixedTaps taps{exact.first, {}};
        for (const double weight : exact.weights) {
            const double scaled = weight * (1 << kWeightBits);
            taps.weights.push_back(
                static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5));
        }
        all.push_back(std::move(taps));
    }
    return all;
}

/// Resample lines of samples that are `step` apart; the lines start at `base`.
void resample_line(const std::uint16_t* base, std::size_t step, const std::vector<FixedTaps>& taps,
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
    const std::vector<FixedTaps> taps = fixed_taps(image.width, width, filter);
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
    const std::vector<FixedTaps> taps = fixed_taps(image.height, height, filter);
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
