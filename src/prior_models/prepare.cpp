#include "prior_models/prepare.h"

#include <algorithm>
#include <cmath>

#include "data/resample.h"

namespace splat::prior_models {
namespace {

constexpr double kMostPixels = 1 << 26;

/// The factors of both sides.
std::array<double, 2> factors_of(const PresetInput& input, Extent picture) {
    const double across = static_cast<double>(input.width) / picture.width;
    const double down = static_cast<double>(input.height) / picture.height;
    const double least = std::min(across, down), most = std::max(across, down);
    switch (input.fit) {
        case Fit::kMinimal: {
            const double nearer = std::abs(1 - across) < std::abs(1 - down) ? across : down;
            return {nearer, nearer};
        }
        case Fit::kUpperBound:
            return {least, least};
        case Fit::kLowerBound:
            return {most, most};
        default:
            return {across, down};
    }
}

/// A side as a multiple: the nearest, ties to even, but beyond the bound of `fit` the next one within.
double multiple_of(const PresetInput& input, double side, double bound) {
    const double step = input.multiple;
    double rounded = std::nearbyint(side / step) * step;
    if (input.fit == Fit::kUpperBound && rounded > bound) rounded = std::floor(side / step) * step;
    if (input.fit == Fit::kLowerBound && rounded < bound) rounded = std::ceil(side / step) * step;
    return std::max(rounded, step);
}

/// [height,width,3], 0 to 255, in the size of the input.
Result<std::vector<double>> resized(const PresetInput& input, const io::Image& picture,
                                    Extent size) {
    io::Image rgb{picture.width, picture.height, 3, 8, {}};
    const std::size_t pixels = std::size_t{picture.width} * picture.height;
    rgb.samples.resize(3 * pixels);
    const bool gray = picture.channels < 3;
    for (std::size_t i = 0; i < pixels; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            rgb.samples[3 * i + c] = picture.samples[i * picture.channels + (gray ? 0 : c)];
    SPLAT_ASSIGN(std::vector<double> values, resample_bytes(rgb, size, input.filter));
    if (input.filter == data::ValueFilter::kLinearOrigin)
        for (double& value : values) value = std::floor(value + 0.5);
    return values;
}

}  // namespace

Result<std::vector<double>> resample_bytes(const io::Image& bytes, Extent size,
                                           data::ValueFilter filter) {
    using data::ValueFilter;
    constexpr std::pair<ValueFilter, data::Filter> kPillow[] = {
        {ValueFilter::kPillowBilinear, data::Filter::kBilinear},
        {ValueFilter::kPillowBicubic, data::Filter::kBicubic},
        {ValueFilter::kPillowLanczos, data::Filter::kLanczos}};
    for (const auto& [name, pillow] : kPillow)
        if (filter == name) {
            SPLAT_ASSIGN(const io::Image made,
                         data::resample(bytes, size.width, size.height, pillow));
            return std::vector<double>(made.samples.begin(), made.samples.end());
        }
    return data::resample_values(std::span<const std::uint16_t>(bytes.samples), bytes.width,
                                 bytes.height, bytes.channels, size.width, size.height, filter);
}

Result<Extent> input_extent(const PresetInput& input, Extent picture) {
    if (input.fit == Fit::kOwn) return picture;
    if (input.fit == Fit::kStretch) return Extent{input.width, input.height};
    const auto [across, down] = factors_of(input, picture);
    const double width = multiple_of(input, across * picture.width, input.width);
    const double height = multiple_of(input, down * picture.height, input.height);
    if (!(width * height <= kMostPixels))
        return unsupported(
            "a picture of %u x %u pixels makes an input of %.0f x %.0f, expected at most "
            "2^26 pixels: crop it",
            picture.width, picture.height, width, height);
    return Extent{static_cast<std::uint32_t>(width), static_cast<std::uint32_t>(height)};
}

Result<NetworkTensor> prepare(const PresetInput& input, const io::Image& picture, Extent size) {
    SPLAT_TRY(io::check_image(picture));
    if (picture.bits != 8) return invalid("a picture of %u bits, expected 8", picture.bits);
    SPLAT_ASSIGN(const std::vector<double> values, resized(input, picture, size));
    constexpr double kLeastMaximum = 1e-6;
    const double scale =
        input.by_maximum ? std::max(*std::ranges::max_element(values), kLeastMaximum) : input.scale;
    const std::size_t area = std::size_t{size.width} * size.height;
    NetworkTensor tensor;
    tensor.dims = {1, 3, size.height, size.width};
    if (input.channels_last) tensor.dims = {1, size.height, size.width, 3};
    tensor.values.resize(3 * area);
    for (std::size_t i = 0; i < area; ++i)
        for (std::size_t c = 0; c < 3; ++c)
            tensor.values[input.channels_last ? 3 * i + c : c * area + i] =
                static_cast<float>((values[3 * i + c] / scale - input.mean[c]) / input.std[c]);
    return tensor;
}

}  // namespace splat::prior_models
