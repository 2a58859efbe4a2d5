// Sample models with the interface of every preset, through ONNX Runtime, against the reference's steps in float64.
#include "prior_models/prior_model.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <thread>

#include "data/resample.h"
#include "prior_models/onnx/sample_models.h"
#include "prior_models/point_depth.h"
#include "ref/images/priors_ref.h"
#include "support/expect_status.h"
#include "support/system.h"

namespace splat::prior_models {
namespace {

using data::MapKind;
using data::ValueFilter;

std::string saved(const test::OnnxGraph& graph, const std::string& name) {
    const std::string path = testing::TempDir() + "prior_model_" + name + ".onnx";
    graph.save(path);
    return path;
}

io::Image wavy_picture(std::uint32_t width, std::uint32_t height, double phase) {
    io::Image picture{width, height, 3, 8, {}, 0};
    for (std::uint32_t y = 0; y < height; ++y)
        for (std::uint32_t x = 0; x < width; ++x)
            for (std::uint32_t c = 0; c < 3; ++c)
                picture.samples.push_back(static_cast<std::uint16_t>(
                    120 + 100 * std::sin(0.31 * x + 0.17 * y * (c + 1) + phase)));
    return picture;
}

ref::Pixels resized_ref(const ref::Pixels& from, std::size_t width, std::size_t height,
                        ValueFilter filter) {
    const auto w = static_cast<double>(from.width), h = static_cast<double>(from.height);
    const auto tw = static_cast<double>(width), th = static_cast<double>(height);
    if (from.width == width && from.height == height) return from;
    if (filter == ValueFilter::kCubic) return ref::cubic_resize(from, width, height);
    if (filter == ValueFilter::kLinearOrigin)
        return ref::linear_resize(from, width, height, w / tw, h / th, 0);
    if (filter == ValueFilter::kLinearCorners)
        return ref::linear_resize(from, width, height, (w - 1) / (tw - 1), (h - 1) / (th - 1), 0);
    // These filters take bytes; GoldenNetResample holds them to Pillow's images.
    const data::Filter pillow = filter == ValueFilter::kPillowLanczos   ? data::Filter::kLanczos
                                : filter == ValueFilter::kPillowBicubic ? data::Filter::kBicubic
                                                                        : data::Filter::kBilinear;
    io::Image image{
        static_cast<std::uint32_t>(from.width),    static_cast<std::uint32_t>(from.height),
        static_cast<std::uint32_t>(from.channels), 8,
        {from.values.begin(), from.values.end()},  0};
    const auto made = data::resample(image, static_cast<std::uint32_t>(width),
                                     static_cast<std::uint32_t>(height), pillow)
                          .value();
    return {width, height, from.channels, {made.samples.begin(), made.samples.end()}};
}

/// The size of the input, by the rules of MiDaS.
std::pair<std::size_t, std::size_t> input_size_ref(const PresetInput& input, double w, double h) {
    if (input.fit == Fit::kOwn) return {w, h};
    if (input.fit == Fit::kStretch) return {input.width, input.height};
    const double across = input.width / w, down = input.height / h;
    const double factor = input.fit == Fit::kUpperBound               ? std::min(across, down)
                          : std::abs(1 - across) < std::abs(1 - down) ? across
                                                                      : down;
    return {ref::midas_side(factor * w), ref::midas_side(factor * h)};
}

/// The input of a picture, [height,width,3].
ref::Pixels input_ref(const PresetInput& input, const io::Image& picture) {
    const ref::Pixels from{
        picture.width, picture.height, 3, {picture.samples.begin(), picture.samples.end()}};
    const auto [width, height] = input_size_ref(input, picture.width, picture.height);
    ref::Pixels made = resized_ref(from, width, height, input.filter);
    if (input.filter == ValueFilter::kLinearOrigin)
        for (double& value : made.values) value = std::round(value);
    const double scale =
        input.by_maximum ? *std::max_element(made.values.begin(), made.values.end()) : input.scale;
    for (std::size_t i = 0; i < made.values.size(); ++i)
        made.values[i] = (made.values[i] / scale - input.mean[i % 3]) / input.std[i % 3];
    return made;
}

/// Sums of the channels of every pixel.
ref::Pixels sums_ref(const ref::Pixels& input, std::span<const test::ChannelSum> sums) {
    ref::Pixels made{input.width, input.height, sums.size(), {}};
    for (std::size_t i = 0; i < input.values.size(); i += 3)
        for (const test::ChannelSum& sum : sums) {
            double value = static_cast<double>(sum.bias);
            for (std::size_t c = 0; c < 3; ++c)
                value += static_cast<double>(sum.weights[c]) * input.values[i + c];
            made.values.push_back(value);
        }
    return made;
}

/// The mask's bytes, steps in the order of the preset.
std::vector<double> mask_ref(const PresetOutput& output, ref::Pixels mask,
                             const io::Image& picture) {
    for (double& value : mask.values) value = 1 / (1 + std::exp(-value));
    if (output.min_max) ref::min_max(mask.values);
    for (double& value : mask.values) value *= 255;
    if (output.bytes_first)
        for (double& value : mask.values) value = std::floor(value);
    mask = resized_ref(mask, picture.width, picture.height, output.filter);
    for (double& value : mask.values) {
        value = output.bytes_first ? std::round(value) : std::floor(value);
        if (output.threshold) value = value > *output.threshold ? 255 : 0;
    }
    return mask.values;
}

/// The bytes of a map of a picture.
std::vector<double> map_ref(const Preset& preset, MapKind kind, const io::Image& picture) {
    const PresetOutput& output = *preset.find(kind);
    const ref::Pixels input = input_ref(preset.input, picture);
    if (kind == MapKind::kMask)
        return mask_ref(output, sums_ref(input, {&test::kSampleMask, 1}), picture);
    if (kind == MapKind::kNormal) {
        const auto bytes =
            ref::normal_bytes(resized_ref(sums_ref(input, test::kSampleNormals), picture.width,
                                          picture.height, output.filter)
                                  .values);
        return {bytes.begin(), bytes.end()};
    }
    ref::Pixels depth = sums_ref(input, {&test::kSampleDepth, 1});
    if (output.depth == DepthOf::kPoints) {
        // PointDepth holds the shift to cameras whose depth is known.
        const ref::Pixels points = sums_ref(input, test::kSamplePoints);
        const ref::Pixels mask = sums_ref(input, {&test::kSampleMask, 1});
        NetworkTensor valid{
            {1, static_cast<std::int64_t>(mask.height), static_cast<std::int64_t>(mask.width)}, {}};
        for (const double value : mask.values)
            valid.values.push_back(static_cast<float>(1 / (1 + std::exp(-value))));
        const Planes planes{
            {picture.width, picture.height}, 3, {points.values.begin(), points.values.end()}};
        const Planes made =
            point_depth(planes, {nullptr, nullptr, &valid, 0}, "points").value().depth;
        depth.values.clear();
        for (const float value : made.values)
            depth.values.push_back(1 / static_cast<double>(value));
    }
    const auto bytes =
        ref::depth_bytes(resized_ref(depth, picture.width, picture.height, output.filter).values);
    return {bytes.begin(), bytes.end()};
}

/// Truncation may go either way where float32 meets a whole number: few bytes, by 1 (a threshold: by all).
void expect_close(const PriorMap& map, const std::vector<double>& expected,
                  const std::string& what) {
    ASSERT_EQ(map.values.size(), expected.size()) << what;
    std::size_t differ = 0;
    bool flat = true;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        const double off = std::abs(static_cast<double>(map.values[i]) - expected[i]);
        EXPECT_TRUE(off <= 1 || off == 255) << what << " at " << i;
        differ += off != 0 ? 1 : 0;
        flat = flat && map.values[i] == map.values[0];
    }
    EXPECT_LE(differ, 2 + expected.size() / 200) << what;
    EXPECT_FALSE(flat) << what << ": the test shows nothing";
}

WantedMaps all_maps(const Preset& preset, MapForm form) {
    WantedMaps wanted;
    for (const MapKind kind : data::kMaps)
        if (preset.find(kind) != nullptr) wanted[kind] = form;
    return wanted;
}

TEST(PriorModel, EveryPresetGivesTheReferencesMaps) {
    for (const std::string& name : preset_names()) {
        const auto model =
            need(PriorModel::create({name, saved(test::sample_model(name), name), "", 1}));
        const Preset& preset = model->preset();
        // Two of one size, which models of any batch run at once, and another.
        const std::vector<io::Image> pictures = {wavy_picture(40, 30, 0), wavy_picture(40, 30, 2),
                                                 wavy_picture(27, 33, 4)};
        const std::vector<WantedMaps> wanted(3, all_maps(preset, MapForm::kBytes));
        const auto maps = need(model->run(pictures, wanted));
        for (std::size_t i = 0; i < pictures.size(); ++i)
            for (const MapKind kind : data::kMaps) {
                if (preset.find(kind) == nullptr) continue;
                ASSERT_TRUE(maps[i][kind]) << name;
                EXPECT_EQ(maps[i][kind]->size, (Extent{pictures[i].width, pictures[i].height}));
                expect_close(
                    *maps[i][kind], map_ref(preset, kind, pictures[i]),
                    name + " " + data::map_name(kind) + " of picture " + std::to_string(i));
            }
    }
}

TEST(PriorModel, IsFoundByItsFileAndInItsFolder) {
    const std::filesystem::path folder = testing::TempDir() + "prior_models";
    std::filesystem::create_directories(folder);
    test::sample_model("u2net").save((folder / "u2net.onnx").string());
    EXPECT_OK(PriorModel::create({"", (folder / "u2net.onnx").string(), "", 1}));
    test::set_variable("SPLAT_PRIORS_DIR", folder.string());
    EXPECT_OK(PriorModel::create({"u2net", "", "", 1}));
    EXPECT_ERROR(PriorModel::create({"inspyrenet", "", "", 1}), Code::kNotFound,
                 "'vkrun priors where inspyrenet'");
    test::unset_variable("SPLAT_PRIORS_DIR");
    EXPECT_ERROR(PriorModel::create({"u2net", "/nowhere/u2net.onnx", "", 1}), Code::kNotFound,
                 "there is no file '/nowhere/u2net.onnx'");
    test::sample_model("birefnet").save((folder / "other.onnx").string());
    EXPECT_ERROR(PriorModel::create({"u2net", (folder / "other.onnx").string(), "", 1}),
                 Code::kFormat, "the preset's file 175997641: another model, or fetched in part");
    EXPECT_ERROR(PriorModel::create({"", "/nowhere/net.onnx", "", 1}), Code::kNotFound,
                 "no preset has a file 'net.onnx'");
}

TEST(PriorModel, TakesHalfPrecisionChannelsLastAndItsOwnSize) {
    // A layout that no embedded preset has: NHWC, float16, four outputs.
    test::OnnxGraph graph;
    graph.input("x", test::kOnnxHalf, {1, 6, 8, 3});
    graph.node("Cast", {"x"}, "wide", {{"to", {test::kOnnxFloat}, false}});
    graph.node("Transpose", {"wide"}, "planes", {{"perm", {0, 3, 1, 2}}});
    graph.floats("w", {1, 3, 1, 1}, {1, 1, -1}).node("Conv", {"planes", "w"}, "sum");
    graph.node("Transpose", {"sum"}, "rows", {{"perm", {0, 2, 3, 1}}});
    graph.node("Cast", {"rows"}, "y", {{"to", {test::kOnnxHalf}, false}});
    graph.output("planes", test::kOnnxFloat, {1, 3, 6, 8})
        .output("sum", test::kOnnxFloat, {1, 1, 6, 8});
    graph.output("rows", test::kOnnxFloat, {1, 6, 8, 1}).output("y", test::kOnnxHalf, {1, 6, 8, 1});
    const std::string preset =
        R"({"name": "own", "input": {"layout": "NHWC", "fit": "minimal", "size": [32, 32], "multiple": 32,)"
        R"( "filter": "pillow_bilinear"}, "outputs": [{"map": "depth", "index": 3, "layout": "NHWC",)"
        R"( "filter": "linear"}]})";
    const auto model = need(PriorModel::create({preset, saved(graph, "half"), "", 1}));
    EXPECT_EQ(model->input_size(), (Extent{8, 6})) << "the model's own size, not the rule's";
    const io::Image picture = wavy_picture(8, 6, 1);
    WantedMaps wanted;
    wanted[MapKind::kDepth] = MapForm::kModels;
    const auto maps = need(model->run({&picture, 1}, {&wanted, 1}));
    const std::vector<float>& depth = maps[0][MapKind::kDepth]->values;
    for (std::size_t i = 0; i < 48; ++i) {
        const double sum =
            (picture.samples[3 * i] + picture.samples[3 * i + 1] - picture.samples[3 * i + 2]) /
            255.0;
        EXPECT_NEAR(depth[i], sum, 2e-3) << "three roundings to float16";
    }
}

TEST(PriorModel, RunsOnSeveralThreads) {
    const auto model =
        need(PriorModel::create({"u2net", saved(test::sample_model("u2net"), "threads"), "", 2}));
    const io::Image picture = wavy_picture(40, 30, 0);
    const WantedMaps wanted = all_maps(model->preset(), MapForm::kUnit);
    const auto run = [&] {
        return model->run({&picture, 1}, {&wanted, 1}).value()[0][MapKind::kMask]->values;
    };
    const std::vector<float> expected = run();
    std::vector<std::thread> threads;
    std::vector<int> equal(4);
    for (int& result : equal) threads.emplace_back([&] { result = run() == expected ? 1 : 0; });
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(equal, (std::vector<int>{1, 1, 1, 1}));
}

}  // namespace
}  // namespace splat::prior_models
