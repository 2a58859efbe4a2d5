// Models whose network the caller opens from weights, in the place of ONNX Runtime.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "prior_models/prior_model.h"
#include "support/expect_status.h"

namespace splat::prior_models {
namespace {

using data::MapKind;

/// Points of a wall that a camera sees, of the picture's size; with the interface of MoGe-2.
class WallNetwork : public Network {
  public:
    explicit WallNetwork(std::string path) : path_(std::move(path)) {}
    [[nodiscard]] const std::vector<NetworkPort>& inputs() const override { return inputs_; }
    [[nodiscard]] const std::vector<NetworkPort>& outputs() const override { return outputs_; }
    [[nodiscard]] const std::string& path() const override { return path_; }
    [[nodiscard]] const std::string& runtime_version() const override { return version_; }
    [[nodiscard]] std::string preset() const override { return "moge-2-vits-normal"; }

    static constexpr double kFocal = 30;
    Result<std::vector<NetworkTensor>> run(const NetworkTensor& input, std::int64_t tokens,
                                           std::span<const std::size_t> wanted) const override {
        const std::int64_t height = input.dims[2], width = input.dims[3];
        EXPECT_EQ(tokens, 1200);
        std::vector<NetworkTensor> all = {{{1, height, width, 3}, {}},
                                          {{1, height, width, 3}, {}},
                                          {{1, height, width}, {}},
                                          {{1}, {2}}};
        for (std::int64_t y = 0; y < height; ++y)
            for (std::int64_t x = 0; x < width; ++x) {
                const double z = 2 + 0.5 * std::sin(0.4 * static_cast<double>(x + y));
                const double u = (static_cast<double>(x) + 0.5 - static_cast<double>(width) / 2);
                const double v = (static_cast<double>(y) + 0.5 - static_cast<double>(height) / 2);
                for (const double value : {u * z / kFocal, v * z / kFocal, z - 0.7})
                    all[0].values.push_back(static_cast<float>(value));
                for (const float value : {0.0F, 0.0F, -1.0F}) all[1].values.push_back(value);
                all[2].values.push_back(1);
            }
        std::vector<NetworkTensor> given;
        for (const std::size_t output : wanted) given.push_back(all[output]);
        return given;
    }

  private:
    std::string path_, version_;
    std::vector<NetworkPort> inputs_ = {{"image", kOrtFloat, {1, 3, -1, -1}},
                                        {"num_tokens", kOrtInt64, {}}};
    std::vector<NetworkPort> outputs_ = {{"points", kOrtFloat, {1, -1, -1, 3}},
                                         {"normal", kOrtFloat, {1, -1, -1, 3}},
                                         {"mask", kOrtFloat, {1, -1, -1}},
                                         {"metric_scale", kOrtFloat, {1}}};
};

/// A file that is named like weights; the network above needs nothing of it.
PriorModelDesc desc_of(const char* preset, std::uint32_t tokens = 1200) {
    const std::string path = testing::TempDir() + "own_network.pt";
    std::ofstream(path) << "weights";
    return {preset, path, "/nowhere/no.so", 0, tokens, [](const std::string& opened) {
                return Result<std::unique_ptr<Network>>(std::make_unique<WallNetwork>(opened));
            }};
}

TEST(OwnNetwork, TakesThePlaceOfOnnxRuntime) {
    const auto model = need(PriorModel::create(desc_of("moge-2-vits-normal")));
    EXPECT_EQ(model->network().runtime_version(), "");
    io::Image picture{40, 30, 3, 8, std::vector<std::uint16_t>(std::size_t{3} * 40 * 30, 99)};
    WantedMaps wanted;
    for (const MapKind map : {MapKind::kDepth, MapKind::kNormal, MapKind::kMask})
        wanted[map] = MapForm::kModels;
    const auto maps = need(model->run({&picture, 1}, {&wanted, 1}));
    const PriorMap& depth = *maps[0][MapKind::kDepth];
    EXPECT_NEAR(depth.focal, WallNetwork::kFocal, 0.05);
    for (std::size_t i = 0; i < depth.values.size(); ++i)
        EXPECT_NEAR(depth.values[i],
                    2 * (2 + 0.5 * std::sin(0.4 * static_cast<double>(i % 40 + i / 40))), 0.02);
    EXPECT_EQ(maps[0][MapKind::kNormal]->values[2], -1);
    EXPECT_EQ(maps[0][MapKind::kNormal]->focal, 0);
}

TEST(OwnNetwork, TellsThePresetWhereNoneIsNamed) {
    EXPECT_EQ(need(PriorModel::create(desc_of("")))->preset().name, "moge-2-vits-normal");
}

TEST(OwnNetwork, OfAnotherPresetIsRefused) {
    EXPECT_ERROR(PriorModel::create(desc_of("moge-2-vitb-normal")), Code::kFormat,
                 "own_network.pt' has the weights of 'moge-2-vits-normal', expected those of "
                 "'moge-2-vitb-normal' for preset 'moge-2-vitb-normal'");
    EXPECT_ERROR(PriorModel::create(desc_of("u2net", 0)), Code::kFormat,
                 "expected those of 'u2net'");
    PriorModelDesc nobody = desc_of("moge-2-vits-normal");
    nobody.open_weights = {};
    EXPECT_ERROR(PriorModel::create(nobody), Code::kUnsupported, "holds weights");
}

}  // namespace
}  // namespace splat::prior_models
