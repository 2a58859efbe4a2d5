#include "prior_models/finish.h"

#include <gtest/gtest.h>

#include <limits>

#include "ref/images/priors_ref.h"
#include "support/golden_file.h"

namespace splat::prior_models {
namespace {

using Bytes = std::vector<std::uint8_t>;

PresetOutput output_of(const char* preset, data::MapKind map) {
    return *preset_of(preset).value().find(map);
}

NetworkTensor tensor_of(std::vector<std::int64_t> dims,
                        const std::function<float(std::size_t)>& value) {
    NetworkTensor tensor{std::move(dims), {}};
    std::int64_t count = 1;
    for (const std::int64_t dim : tensor.dims) count *= dim;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
        tensor.values.push_back(value(i));
    return tensor;
}

/// Numbers that look random, from -1 to 1.
float drawn(std::size_t i) {
    return static_cast<float>(std::sin(12.9898 * static_cast<double>(i + 1)));
}

PriorMap map_of(const PresetOutput& output, const NetworkTensor& tensor, Extent size,
                MapForm form) {
    return need(finish(output, {&tensor, nullptr, nullptr, 0}, size, form, "output"));
}

Bytes bytes_of(const PriorMap& map) {
    Bytes bytes;
    for (const float value : map.values) {
        EXPECT_EQ(value, std::floor(value));
        bytes.push_back(static_cast<std::uint8_t>(value));
    }
    return bytes;
}

/// Equal but for steps of 1 where the reference lies within 1e-4 of a whole number: float32 truncates there either
/// way. `exact` are the reference's numbers before truncation.
void expect_bytes(const Bytes& found, const std::vector<double>& exact) {
    ASSERT_EQ(found.size(), exact.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        const double value = std::clamp(exact[i], 0.0, 255.0);
        EXPECT_TRUE(found[i] == std::floor(value) || std::abs(value - std::round(value)) < 1e-4)
            << i << ": " << int{found[i]} << ", expected " << value;
    }
}

TEST(GoldenNetPrior, OutputsBecomeTheReferencesMaps) {
    SPLAT_NEEDS_GOLDEN_FOLDER();
    test::each_golden("prior", [](const test::Golden& golden) {
        const struct {
            const char *preset, *in, *unit, *bytes;
            data::MapKind map;
        } cases[] = {
            {"midas-dpt-large", "depth.in", "depth.unit", "depth.u8", data::MapKind::kDepth},
            {"normal-uncertainty-scannet", "normal.in", "normal.unit", "normal.u8",
             data::MapKind::kNormal}};
        for (const auto& one : cases) {
            const PresetOutput output = output_of(one.preset, one.map);
            const std::size_t channels = data::channels_of(one.map);
            const NetworkTensor tensor{golden.dims(one.in), golden.floats(one.in)};
            const std::vector<double> unit = golden.doubles(one.unit);
            const auto bytes = golden.array(one.bytes).ints().value();
            const std::size_t rank = golden.dims(one.bytes).size();
            const Extent size{golden.dim(one.bytes, rank - 1), golden.dim(one.bytes, rank - 2)};
            const std::size_t area = std::size_t{size.width} * size.height, all = area * channels;
            std::size_t differ = 0;
            for (std::size_t n = 0; n < golden.dim(one.in, 0); ++n) {
                const MapSource source{&tensor, nullptr, nullptr, n};
                const auto map = finish(output, source, size, MapForm::kUnit, "output").value();
                const auto made = finish(output, source, size, MapForm::kBytes, "output").value();
                for (std::size_t i = 0; i < area; ++i)
                    for (std::size_t c = 0; c < channels; ++c) {
                        const std::size_t at = n * all + c * area + i;
                        const double expected = channels == 3 ? (unit[at] + 1) / 2 : unit[at];
                        EXPECT_NEAR(map.values[i * channels + c], expected, 2e-6) << one.unit;
                        const auto found = static_cast<std::int64_t>(made.values[i * channels + c]);
                        EXPECT_LE(std::abs(found - bytes[at]), 1) << one.bytes;
                        differ += found != bytes[at] ? 1 : 0;
                    }
            }
            EXPECT_LE(differ, 2U) << one.bytes << ": truncation, not rounding";
        }
    });
}

TEST(PriorMap, DepthIsScaledAndConstantDepthIsZero) {
    const PresetOutput output = output_of("midas-small", data::MapKind::kDepth);
    const NetworkTensor tensor = tensor_of({1, 4, 5}, drawn);
    const ref::Pixels from{5, 4, 1, {tensor.values.begin(), tensor.values.end()}};
    std::vector<double> exact = ref::cubic_resize(from, 9, 7).values;
    const PriorMap models = map_of(output, tensor, {9, 7}, MapForm::kModels);
    for (std::size_t i = 0; i < exact.size(); ++i) EXPECT_NEAR(models.values[i], exact[i], 1e-6);
    ref::min_max(exact);
    for (double& value : exact) value *= 255;
    expect_bytes(bytes_of(map_of(output, tensor, {9, 7}, MapForm::kBytes)), exact);
    const NetworkTensor flat = tensor_of({1, 1, 4, 5}, [](std::size_t) { return 3.0F; });
    EXPECT_EQ(bytes_of(map_of(output, flat, {5, 4}, MapForm::kBytes)), Bytes(20, 0));
}

TEST(PriorMap, DistancesBecomeInverse) {
    PresetOutput output = output_of("midas-small", data::MapKind::kDepth);
    output.depth = DepthOf::kDistance;
    const NetworkTensor tensor =
        tensor_of({1, 4}, [](std::size_t i) { return static_cast<float>(1 << i); });
    // 1, 1/2, 1/4, 1/8 from 1/8 to 1.
    EXPECT_EQ(bytes_of(map_of(output, tensor, {4, 1}, MapForm::kBytes)), (Bytes{255, 109, 36, 0}));
    EXPECT_EQ(map_of(output, tensor, {4, 1}, MapForm::kModels).values,
              (std::vector<float>{1, 2, 4, 8}));
}

TEST(PriorMap, NormalsAreTurnedIntoTheCamerasAxes) {
    PresetOutput output = output_of("normal-uncertainty-nyu", data::MapKind::kNormal);
    output.signs = {1, -1, -1};
    const NetworkTensor tensor = tensor_of({1, 4, 1, 1}, [](std::size_t i) {
        return std::array<float, 4>{0.6F, 1.6F, -1.2F, 9}[i];
    });
    const double length = std::sqrt(0.36 + 2.56 + 1.44);
    const PriorMap map = map_of(output, tensor, {1, 1}, MapForm::kModels);
    EXPECT_NEAR(map.values[0], 0.6 / length, 1e-6);
    EXPECT_NEAR(map.values[1], -1.6 / length, 1e-6);
    EXPECT_NEAR(map.values[2], 1.2 / length, 1e-6);
    expect_bytes(
        bytes_of(map_of(output, tensor, {1, 1}, MapForm::kBytes)),
        {127.5 * (1 + 0.6 / length), 127.5 * (1 - 1.6 / length), 127.5 * (1 + 1.2 / length)});
    const NetworkTensor none = tensor_of({1, 4, 1, 1}, [](std::size_t) { return 0.0F; });
    EXPECT_EQ(bytes_of(map_of(output, none, {1, 1}, MapForm::kBytes)), (Bytes{127, 127, 127}));
}

TEST(PriorMap, ChannelsMayComeLast) {
    PresetOutput output = output_of("moge-2-vits", data::MapKind::kNormal);
    const NetworkTensor first = tensor_of({1, 3, 4, 5}, drawn);
    NetworkTensor last{{1, 4, 5, 3}, std::vector<float>(60)};
    for (std::size_t i = 0; i < 20; ++i)
        for (std::size_t c = 0; c < 3; ++c) last.values[3 * i + c] = first.values[20 * c + i];
    const PriorMap found = map_of(output, last, {7, 6}, MapForm::kBytes);
    output.channels_last = false;
    EXPECT_EQ(found.values, map_of(output, first, {7, 6}, MapForm::kBytes).values);
}

TEST(PriorMap, MasksOfRembgAreBytesBeforeTheyAreResized) {
    const PresetOutput output = output_of("birefnet-general", data::MapKind::kMask);
    const NetworkTensor tensor =
        tensor_of({1, 1, 6, 6}, [](std::size_t i) { return 4 * drawn(i); });
    std::vector<double> unit;
    for (const float value : tensor.values)
        unit.push_back(1 / (1 + std::exp(-static_cast<double>(value))));
    ref::min_max(unit);
    io::Image image{6, 6, 1, 8, {}, 0};
    for (const double value : unit)
        image.samples.push_back(static_cast<std::uint16_t>(255 * value));
    const auto expected = data::resample(image, 11, 4, data::Filter::kLanczos).value().samples;
    const Bytes found = bytes_of(map_of(output, tensor, {11, 4}, MapForm::kBytes));
    EXPECT_EQ(Bytes(expected.begin(), expected.end()), found);
    const PriorMap soft = map_of(output, tensor, {11, 4}, MapForm::kUnit);
    for (const float value : soft.values) {
        EXPECT_GE(value, 0);
        EXPECT_LE(value, 1);
    }
    const NetworkTensor flat = tensor_of({1, 1, 3, 3}, [](std::size_t) { return 0.5F; });
    EXPECT_EQ(bytes_of(map_of(output, flat, {3, 3}, MapForm::kBytes)), Bytes(9, 0));
}

TEST(PriorMap, OtherMasksAreResizedBeforeTheyAreBytes) {
    PresetOutput output = output_of("inspyrenet", data::MapKind::kMask);
    const NetworkTensor tensor =
        tensor_of({1, 1, 4, 5}, [](std::size_t i) { return 0.5F + 0.5F * drawn(i); });
    const ref::Pixels from{5, 4, 1, {tensor.values.begin(), tensor.values.end()}};
    std::vector<double> exact = ref::linear_resize(from, 9, 7, 4.0 / 8, 3.0 / 6, 0).values;
    for (double& value : exact) value *= 255;
    const Bytes hard = bytes_of(map_of(output, tensor, {9, 7}, MapForm::kBytes));
    output.threshold.reset();
    expect_bytes(bytes_of(map_of(output, tensor, {9, 7}, MapForm::kBytes)), exact);
    for (std::size_t i = 0; i < hard.size(); ++i)
        EXPECT_EQ(hard[i], std::floor(exact[i]) > 127 ? 255 : 0) << exact[i];
}

TEST(PriorMap, RefusesOtherShapesAndNumbers) {
    const PresetOutput mask = output_of("u2net", data::MapKind::kMask);
    const PresetOutput normal = output_of("normal-uncertainty-nyu", data::MapKind::kNormal);
    const auto status = [](const PresetOutput& output, const NetworkTensor& tensor) {
        return finish(output, {&tensor, nullptr, nullptr, 0}, {4, 4}, MapForm::kBytes,
                      "'m': output 'y'")
            .status();
    };
    EXPECT_ERROR(
        status(normal, tensor_of({1, 2, 3, 3}, drawn)), Code::kFormat,
        "'m': output 'y' has the shape [1,2,3,3], expected [n,channels,height,width] with 3");
    EXPECT_ERROR(status(normal, tensor_of({3, 3, 3}, drawn)), Code::kFormat, "[3,3,3]");
    EXPECT_ERROR(status(mask, tensor_of({9}, drawn)), Code::kFormat, "[9]");
    EXPECT_ERROR(status(mask, tensor_of({0, 1, 3, 3}, drawn)), Code::kFormat, "[0,1,3,3]");
    EXPECT_ERROR(status(mask, tensor_of({1, 1, 0, 3}, drawn)), Code::kFormat,
                 "sides of 1 to 16384");
    for (const float bad :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()})
        EXPECT_ERROR(status(mask, tensor_of({1, 1, 3, 3},
                                            [bad](std::size_t i) { return i == 5 ? bad : 0; })),
                     Code::kInvalidState, "at row 1, column 2");
}

}  // namespace
}  // namespace splat::prior_models
