#include "data/resample.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

#include "core/shown.h"

namespace splat::data {
namespace {

constexpr const char* kNames[] = {"nearest", "linear",          "linear_corners", "linear_origin",
                                  "cubic",   "pillow_bilinear", "pillow_bicubic", "pillow_lanczos"};
constexpr int kWeightBits = 22;

/// The samples that contribute to one new sample, and their weights.
template <class Weight>
struct Taps {
    std::size_t first = 0;
    std::vector<Weight> weights;
};
using ExactTaps = std::vector<Taps<double>>;

double sinc(double x) {
    return x == 0 ? 1 : std::sin(std::numbers::pi * x) / (std::numbers::pi * x);
}

double pillow_kernel(Filter filter, double x) {
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

/// Weights of each new sample: Pillow's kernels, widened by a reduction, with a sum of 1.
ExactTaps pillow_taps(std::uint32_t from, std::uint32_t to, Filter filter) {
    const double scale = static_cast<double>(from) / to;
    const double widened = std::max(scale, 1.0);
    const double support = support_of(filter) * widened;
    ExactTaps all(to);
    for (std::uint32_t i = 0; i < to; ++i) {
        const double center = (i + 0.5) * scale;
        const auto first = static_cast<std::size_t>(std::max(0.0, center - support + 0.5));
        const auto end =
            std::min<std::size_t>(from, static_cast<std::size_t>(center + support + 0.5));
        all[i].first = first;
        double sum = 0;
        for (std::size_t k = first; k < end; ++k) {
            all[i].weights.push_back(
                pillow_kernel(filter, (static_cast<double>(k) - center + 0.5) * (1 / widened)));
            sum += all[i].weights.back();
        }
        if (sum == 0) continue;
        for (double& weight : all[i].weights) weight *= 1 / sum;
    }
    return all;
}

/// The same taps in fixed point.
std::vector<Taps<std::int32_t>> fixed_taps(std::uint32_t from, std::uint32_t to, Filter filter) {
    std::vector<Taps<std::int32_t>> all;
    for (const Taps<double>& exact : pillow_taps(from, to, filter)) {
        all.push_back({exact.first, {}});
        for (const double weight : exact.weights) {
            const double scaled = weight * (1 << kWeightBits);
            all.back().weights.push_back(
                static_cast<std::int32_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5));
        }
    }
    return all;
}

/// Where new sample i lies among the old ones, whose middles are whole numbers.
double position_of(ValueFilter filter, std::uint32_t i, std::uint32_t from, std::uint32_t to) {
    const double scale = static_cast<double>(from) / to;
    switch (filter) {
        case ValueFilter::kLinearCorners:
            return to == 1 ? 0 : static_cast<double>(i) * (from - 1) / (to - 1);
        case ValueFilter::kLinearOrigin:
            return i * scale;
        case ValueFilter::kLinear:
            return std::max(0.0, (i + 0.5) * scale - 0.5);
        default:
            return (i + 0.5) * scale - 0.5;
    }
}

/// The four weights of Keys' kernel with a = -0.75 at a distance of `t` behind the second sample.
std::vector<double> cubic_weights(double t) {
    constexpr double a = -0.75;
    const auto near = [](double x) { return ((a + 2) * x - (a + 3)) * x * x + 1; };
    const auto far = [](double x) { return ((a * x - 5 * a) * x + 8 * a) * x - 4 * a; };
    return {far(t + 1), near(t), near(1 - t), far(2 - t)};
}

/// Weights of samples first, first + 1, ...; those beyond the edge go to the edge.
Taps<double> clamped(std::int64_t first, const std::vector<double>& weights, std::uint32_t from) {
    const std::int64_t last = std::int64_t{from} - 1;
    Taps<double> taps;
    taps.first = static_cast<std::size_t>(std::clamp<std::int64_t>(first, 0, last));
    for (std::size_t k = 0; k < weights.size(); ++k) {
        const auto place = static_cast<std::size_t>(
            std::clamp<std::int64_t>(first + static_cast<std::int64_t>(k), 0, last));
        if (place - taps.first >= taps.weights.size()) taps.weights.push_back(0);
        taps.weights[place - taps.first] += weights[k];
    }
    return taps;
}

ExactTaps value_taps(std::uint32_t from, std::uint32_t to, ValueFilter filter) {
    switch (filter) {
        case ValueFilter::kPillowBilinear:
            return pillow_taps(from, to, Filter::kBilinear);
        case ValueFilter::kPillowBicubic:
            return pillow_taps(from, to, Filter::kBicubic);
        case ValueFilter::kPillowLanczos:
            return pillow_taps(from, to, Filter::kLanczos);
        default:
            break;
    }
    ExactTaps all;
    if (filter == ValueFilter::kNearest) {
        // Pillow adds up the places, with the roundings of a sum.
        const double step = static_cast<double>(from) / to;
        double place = step * 0.5;
        for (std::uint32_t i = 0; i < to; ++i, place += step)
            all.push_back(clamped(static_cast<std::int64_t>(place), {1}, from));
        return all;
    }
    for (std::uint32_t i = 0; i < to; ++i) {
        const double position = position_of(filter, i, from, to);
        const double floor = std::floor(position);
        const double t = position - floor;
        const auto first = static_cast<std::int64_t>(floor);
        if (filter == ValueFilter::kCubic)
            all.push_back(clamped(first - 1, cubic_weights(t), from));
        else
            all.push_back(clamped(first, {1 - t, t}, from));
    }
    return all;
}

std::uint16_t to_sample(std::int64_t sum) {
    return static_cast<std::uint16_t>(std::clamp<std::int64_t>(sum >> kWeightBits, 0, 255));
}

double as_it_is(double sum) {
    return sum;
}

/// Resamples lines of `length` pixels of `channels` numbers: sums begin with `start` and are rounded.
template <class In, class Weight, class Sum, class Out>
std::vector<Out> resampled(std::span<const In> values, std::size_t length, std::size_t channels,
                           const std::vector<Taps<Weight>>& taps, Sum start, Out (*round)(Sum)) {
    std::vector<Out> out;
    out.reserve(values.size() / length * taps.size());
    for (std::size_t line = 0; line < values.size(); line += length * channels)
        for (const Taps<Weight>& each : taps)
            for (std::size_t c = 0; c < channels; ++c) {
                Sum sum = start;
                const In* from = &values[line + each.first * channels + c];
                for (std::size_t k = 0; k < each.weights.size(); ++k)
                    sum += Sum{each.weights[k]} * static_cast<Sum>(from[k * channels]);
                out.push_back(round(sum));
            }
    return out;
}

/// The same of an image of 8 bits, whose lines may be its columns.
void resample_lines(io::Image& image, std::uint32_t& side, std::size_t channels, std::uint32_t to,
                    Filter filter) {
    image.samples =
        resampled(std::span<const std::uint16_t>(image.samples), side, channels,
                  fixed_taps(side, to, filter), std::int64_t{1} << (kWeightBits - 1), to_sample);
    side = to;
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
    if (image.bits != 8) return invalid("an image of %u bits to resample, expected 8", image.bits);
    if (width == 0 || height == 0)
        return invalid("a size of %u x %u pixels, expected 1 x 1 or more", width, height);
    if (width == image.width && height == image.height) return image;
    const bool alpha = image.channels == 2 || image.channels == 4;
    io::Image out = image;
    if (alpha) multiply_alpha(out);
    if (width != out.width) resample_lines(out, out.width, out.channels, width, filter);
    if (height != out.height)
        resample_lines(out, out.height, std::size_t{width} * out.channels, height, filter);
    if (alpha) divide_alpha(out);
    return out;
}

std::optional<ValueFilter> value_filter_of(const std::string& name) {
    const auto* const found = std::ranges::find(kNames, name);
    if (found == std::end(kNames)) return std::nullopt;
    return static_cast<ValueFilter>(found - std::begin(kNames));
}

std::string value_filter_names() {
    return joined(kNames);
}

template <class T>
Result<std::vector<double>> resample_values(std::span<const T> values, std::uint32_t width,
                                            std::uint32_t height, std::uint32_t channels,
                                            std::uint32_t to_width, std::uint32_t to_height,
                                            ValueFilter filter) {
    if (width == 0 || height == 0 || channels == 0 || to_width == 0 || to_height == 0)
        return invalid("%u x %u pixels of %u channels to %u x %u, expected 1 or more of each",
                       width, height, channels, to_width, to_height);
    if (values.size() != std::size_t{width} * height * channels)
        return invalid("%zu numbers for %u x %u pixels of %u channels, expected %zu", values.size(),
                       width, height, channels, std::size_t{width} * height * channels);
    if (width == to_width && height == to_height)
        return std::vector<double>(values.begin(), values.end());
    const std::vector<double> narrow =
        resampled(values, width, channels, value_taps(width, to_width, filter), 0.0, as_it_is);
    return resampled(std::span(narrow), height, std::size_t{to_width} * channels,
                     value_taps(height, to_height, filter), 0.0, as_it_is);
}

template Result<std::vector<double>> resample_values(std::span<const std::uint16_t>, std::uint32_t,
                                                     std::uint32_t, std::uint32_t, std::uint32_t,
                                                     std::uint32_t, ValueFilter);
template Result<std::vector<double>> resample_values(std::span<const float>, std::uint32_t,
                                                     std::uint32_t, std::uint32_t, std::uint32_t,
                                                     std::uint32_t, ValueFilter);

}  // namespace splat::data
