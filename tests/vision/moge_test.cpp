// MoGe-2's sizes, what is refused of files, and its runs; its numbers are compared in tests/nets2/moge2_test.cpp.
#include <gtest/gtest.h>

#include <cmath>

#include "ops/op_harness.h"
#include "support/expect_status.h"
#include "support/golden_file.h"
#include "vision/moge_model.h"
#include "vision/small_moge.h"

namespace splat::test {
namespace {

using vision::MogeModel;

Status refusal(const io::NamedTensors& tensors, const vision::MogeConfig& config = {}) {
    return MogeModel::create(*shared_context(), tensors, config).status();
}

std::unique_ptr<MogeModel> loaded(vk::Context& context, const io::NamedTensors& tensors) {
    auto model = need(MogeModel::create(context, tensors, {}));
    EXPECT_OK(model->load(tensors));
    return model;
}

/// [3,height,width] of waves.
std::vector<float> picture(std::uint32_t width, std::uint32_t height) {
    std::vector<float> values;
    for (std::uint32_t i = 0; i < 3 * width * height; ++i)
        values.push_back(0.5F + 0.4F * std::sin(0.13F * static_cast<float>(i)));
    return values;
}

TEST(MogeSizes, AreThoseOfTheTensors) {
    const auto sizes = need(vision::moge_sizes(small_moge(), {}));
    EXPECT_EQ(sizes.encoder.width, 64U);
    EXPECT_EQ(sizes.encoder.blocks, 2U);
    EXPECT_EQ(sizes.encoder.heads, 1U) << "one for each 64 channels";
    EXPECT_EQ(sizes.encoder.side, 5U);
    EXPECT_EQ(sizes.encoder.taps, (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(sizes.neck.widths, (std::vector<std::uint32_t>{64, 32, 16, 8, 8}));
    EXPECT_EQ(sizes.neck.blocks, (std::vector<std::uint32_t>{0, 1, 1, 0, 0}));
    EXPECT_EQ(sizes.neck.transposed, (std::vector<bool>{true, true, true, false}));
    EXPECT_EQ(sizes.heads.size(), 3U);
    EXPECT_EQ(sizes.scale, (std::vector<std::uint32_t>{64, 1}));
    EXPECT_EQ(vision::moge_preset(sizes), "") << "none of the published";
    EXPECT_EQ(need(vision::moge_sizes(small_moge(false), {})).heads.size(), 2U);
}

TEST(MogeConfig, IsReadFromTheFile) {
    const auto config_of = [](const char* text) {
        return vision::moge_config({{"model_config", text}});
    };
    const auto config = need(config_of(
        R"({"encoder": {"intermediate_layers": [5, 11]}, "remap_output": "exp", "neck":)"
        R"( {"res_block_in_norm": "none", "resamplers": ["conv_transpose", "bilinear"]}})"));
    EXPECT_EQ(config.taps, (std::vector<std::uint32_t>{5, 11}));
    EXPECT_EQ(config.in_norm, vision::BlockNorm::kNone);
    EXPECT_EQ(config.hidden_norm, vision::BlockNorm::kGroup);
    EXPECT_TRUE(need(vision::moge_config({})).taps.empty());
    EXPECT_ERROR(config_of("{"), Code::kFormat, "model_config");
    EXPECT_ERROR(config_of(R"({"remap_output": "linear"})"), Code::kFormat,
                 "remap_output is 'linear', expected exp");
    EXPECT_ERROR(config_of(R"({"neck": {"res_block_in_norm": "batch"}})"), Code::kFormat,
                 "expected none, layer_norm or group_norm");
    EXPECT_ERROR(config_of(R"({"neck": {"resamplers": ["nearest"]}})"), Code::kFormat,
                 "resamplers holds nearest");
}

TEST(MogeWeights, RefusesOtherNetworksByName) {
    const auto only = [](const char* name) {
        io::NamedTensors tensors;
        (void)tensors.add({name, {1}, io::NumberType::kF32, {1.0F}});
        return tensors;
    };
    EXPECT_ERROR(refusal(only("network_with_offset.out.weight")), Code::kFormat,
                 "not the weights of MoGe-2; they look like a SongUNet");
    EXPECT_ERROR(refusal(only("unet.conv_in.weight")), Code::kFormat, "look like LGM");
    EXPECT_ERROR(refusal(only("backbone.blocks.0.norm1.weight")), Code::kFormat, "MoGe-1");
    EXPECT_ERROR(refusal(only("a.b")), Code::kFormat, "its first tensor is 'a.b'");
    EXPECT_ERROR(refusal({}), Code::kFormat, "the file has no tensors");
}

TEST(MogeWeights, RefusesMissingFurtherAndWrongTensors) {
    const io::NamedTensors good = small_moge();
    EXPECT_ERROR(
        refusal(without(good, "neck.resamplers.3.1.bias")), Code::kFormat,
        "1 of the network's 179 tensors are missing, first 'neck.resamplers.3.1.bias' [8]");
    EXPECT_ERROR(refusal(without(good, "encoder.backbone.blocks.1.ls2.gamma")), Code::kFormat,
                 "first 'encoder.backbone.blocks.1.ls2.gamma' [64]");
    EXPECT_ERROR(refusal(without(good, "encoder.backbone.blocks.0.mlp.fc1.weight")), Code::kFormat,
                 "tensor 'encoder.backbone.blocks.0.mlp.fc1.weight' is missing");
    EXPECT_ERROR(refusal(with(good, {"neck.more", {1}, io::NumberType::kF32, {1.0F}})),
                 Code::kFormat, "tensor 'neck.more' [1] is none of the network's");
    io::NamedTensor bias = *good.find("encoder.backbone.norm.bias");
    bias.values.own()[3] = NAN;
    EXPECT_ERROR(refusal(with(good, bias)), Code::kFormat, "encoder.backbone.norm.bias");
    EXPECT_ERROR(refusal(with(good, {"scale_head.0.bias", {2}, io::NumberType::kF32, {1, 2}})),
                 Code::kFormat, "has the shape [2], expected [64]");
    EXPECT_ERROR(
        refusal(with(good, {"encoder.image_std", {1, 3, 1, 1}, io::NumberType::kF32, {1, 0, 1}})),
        Code::kFormat, "holds a number <= 0");
    vision::MogeConfig config;
    config.taps = {1, 0};
    EXPECT_ERROR(refusal(good, config), Code::kFormat, "of 2 blocks in their order");
    config = {};
    config.heads = 5;
    EXPECT_ERROR(refusal(good, config), Code::kFormat, "do not divide into 5 heads");
}

class MogeModelTest : public KernelsTest {};
SPLAT_INSTANTIATE_KERNELS(MogeModelTest);

TEST_P(MogeModelTest, MakesMapsOfAnySizeAlike) {
    const auto model = loaded(context(), small_moge());
    const std::vector<float> wide = picture(70, 40), high = picture(30, 50);
    const auto first = need(model->run(wide, 70, 40, 24));
    EXPECT_EQ(first.points.size(), 3U * 70 * 40);
    EXPECT_EQ(first.mask.size(), 70U * 40);
    for (std::size_t i = 0; i < first.mask.size(); ++i) {
        EXPECT_TRUE(first.mask[i] > 0 && first.mask[i] < 1);
        EXPECT_GT(first.points[3 * i + 2], 0);
        const float* n = &first.normals[3 * i];
        EXPECT_NEAR(n[0] * n[0] + n[1] * n[1] + n[2] * n[2], 1, 1e-5);
    }
    EXPECT_GT(first.scale, 0);
    // A graph of another size, then the first one again: the same parameters.
    EXPECT_EQ(need(model->run(high, 30, 50, 24)).mask.size(), 30U * 50);
    const auto again = need(model->run(wide, 70, 40, 24));
    EXPECT_EQ(again.points, first.points);
    EXPECT_EQ(again.normals, first.normals);
    // The table of positions has as many patches.
    EXPECT_EQ(need(model->run(picture(20, 20), 20, 20, 25)).mask.size(), 400U);
}

/// A residual block of zeros at the last level changes nothing, but then its layers are computed one by one.
TEST_P(MogeModelTest, LastLevelAsOneLayerIsTheSame) {
    io::NamedTensors layered = small_moge();
    for (const std::string layer : {"2", "5"}) {
        const std::string name = "points_head.res_blocks.4.0.layers." + layer;
        constexpr std::int64_t kChannels = 8;
        const std::vector<float> zeros(9 * kChannels * kChannels);
        layered = with(
            layered, {name + ".weight", {kChannels, kChannels, 3, 3}, io::NumberType::kF32, zeros});
        layered = with(
            layered,
            {name + ".bias", {kChannels}, io::NumberType::kF32, std::vector<float>(kChannels)});
    }
    const auto folded = loaded(context(), small_moge());
    const auto model = loaded(context(), layered);
    const std::vector<float> image = picture(70, 40);
    const auto got = need(folded->run(image, 70, 40, 24));
    const auto expected = need(model->run(image, 70, 40, 24));
    const auto expect = [](const char* what, const std::vector<float>& a,
                           const std::vector<float>& b) {
        expect_relative(what, a, std::vector<double>(b.begin(), b.end()), 5e-6);
    };
    expect("points", got.points, expected.points);
    expect("normals", got.normals, expected.normals);
    expect("mask", got.mask, expected.mask);
}

TEST_P(MogeModelTest, RefusesTokensThatDoNotFit) {
    const auto model = loaded(context(), small_moge(false));
    EXPECT_FALSE(model->makes_normals());
    const std::vector<float> image = picture(20, 10);
    EXPECT_ERROR(model->run(image, 20, 10, 1000000), Code::kInvalidArgument,
                 "1000000 tokens make 1414 x 707 patches");
    EXPECT_ERROR(model->run(image, 20, 10, 60000), Code::kUnsupported,
                 "60000 tokens (346 x 173 patches) are too many: ");
    EXPECT_ERROR(model->run(image, 20, 10, 0), Code::kInvalidArgument, "at least 1 each way");
    EXPECT_ERROR(model->run(picture(200, 1), 200, 1, 10), Code::kInvalidArgument, "x 0 patches");
    EXPECT_ERROR(model->run(image, 10, 10, 9), Code::kInvalidArgument, "600 numbers of a picture");
    EXPECT_TRUE(need(model->run(image, 20, 10, 9)).normals.empty());
}

}  // namespace
}  // namespace splat::test
