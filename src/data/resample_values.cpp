#include "data/resample_values.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "data/resample_taps.h"

namespace splat::data {
namespace {

constexpr const char* kNames[] = {"nearest", "linear",          "linear_corners", "linear_origin",
                                  "cubic",   "pillow_bilinear", "pillow_bicubic", "pillow_lanczos"};

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
Taps clamped(std::int64_t first, const std::vector<double>& weights, std::uint32_t from) {
    const std::int64_t last = std::int64_t{from} - 1;
    Taps taps;
    taps.first = static_cast<std::size_t>(std::clamp<std::int64_t>(first, 0, last));
    for (std::size_t k = 0; k < weights.size(); ++k) {
        const auto place = static_cast<std::size_t>(
            std::clamp<std::int64_t>(first + static_cast<std::int64_t>(k), 0, last));
        if (place - taps.first >= taps.weights.size()) taps.weights.push_back(0);
        taps.weights[place - taps.first] += weights[k];
    }
    return taps;
}

std::vector<Taps> value_taps(std::uint32_t from, std::uint32_t to, ValueFilter filter) {
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
    std::vector<Taps> all;
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

/// One line of pixels that are `channels` numbers wide.
template <class T>
void resample_row(const T* row, std::uint32_t channels, const std::vector<Taps>& taps,
                  double* out) {
    for (std::size_t i = 0; i < taps.size(); ++i)
        for (std::size_t c = 0; c < channels; ++c) {
            double sum = 0;
            for (std::size_t k = 0; k < taps[i].weights.size(); ++k)
                sum += taps[i].weights[k] *
                       static_cast<double>(row[(taps[i].first + k) * channels + c]);
            out[i * channels + c] = sum;
        }
}

}  // namespace

std::optional<ValueFilter> value_filter_of(const std::string& name) {
    const auto* const found = std::find(std::begin(kNames), std::end(kNames), name);
    if (found == std::end(kNames)) return std::nullopt;
    return static_cast<ValueFilter>(found - std::begin(kNames));
}

std::string value_filter_names() {
    std::string names;
    for (const char* name : kNames) names += (names.empty() ? "" : ", ") + std::string(name);
    return names;
}

template <class T>
Result<std::vector<double>> resample_values(std::span<const T> values, std::uint32_t width,
                                            std::uint32_t height, std::uint32_t channels,
                                            std::uint32_t to_width, std::uint32_t to_height,
                                            ValueFilter filter) {
    if (width == 0 || height == 0 || channels == 0 || to_width == 0 || to_height == 0)
        return error(Code::kInvalidArgument,
                     "%u x %u pixels of %u channels to %u x %u, expected 1 or more of each", width,
                     height, channels, to_width, to_height);
    if (values.size() != std::size_t{width} * height * channels)
        return error(Code::kInvalidArgument,
                     "%zu numbers for %u x %u pixels of %u channels, expected %zu", values.size(),
                     width, height, channels, std::size_t{width} * height * channels);
    if (width == to_width && height == to_height)
        return std::vector<double>(values.begin(), values.end());
    const std::vector<Taps> across = value_taps(width, to_width, filter);
    const std::vector<Taps> down = value_taps(height, to_height, filter);
    const std::size_t row = std::size_t{to_width} * channels;
    std::vector<double> narrow(row * height);
    for (std::size_t y = 0; y < height; ++y)
        resample_row(values.data() + y * width * channels, channels, across,
                     narrow.data() + y * row);
    std::vector<double> out(row * to_height);
    for (std::size_t y = 0; y < to_height; ++y)
        for (std::size_t k = 0; k < down[y].weights.size(); ++k) {
            const double* const from = narrow.data() + (down[y].first + k) * row;
            for (std::size_t x = 0; x < row; ++x) out[y * row + x] += down[y].weights[k] * from[x];
        }
    return out;
}

template Result<std::vector<double>> resample_values(std::span<const std::uint16_t>, std::uint32_t,
                                                     std::uint32_t, std::uint32_t, std::uint32_t,
                                                     std::uint32_t, ValueFilter);
template Result<std::vector<double>> resample_values(std::span<const float>, std::uint32_t,
                                                     std::uint32_t, std::uint32_t, std::uint32_t,
                                                     std::uint32_t, ValueFilter);

}  // namespace splat::data
