// The published configurations that the library has by name, against the tables of the published files.
#include "config/presets.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "config/config_file.h"
#include "config/effects.h"
#include "support/expect_status.h"

namespace splat::test {
namespace {

/// What the published files say; the other values are those of their default configuration.
struct Published {
    float znear, zfar, fov;
    bool white;
    std::uint32_t resolution, attention;
    float xyz_scale, opacity_scale, opacity_bias, scale_scale;
    std::uint64_t iterations;
    std::uint32_t batch;
    double rate, lpips;
    std::uint32_t views = 1, targets = 4;
    bool depth = false, normal = false;
};

constexpr float kShapeNet = 51.98948897809546F;
constexpr float kZero123 = 49.134342641202636F;
constexpr float kNmr = 29.999999290482176F;

// clang-format off
const std::map<std::string, Published> kPublished = {
    {"cars",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 800001, 8, 5e-5, 0}},
    {"cars_lpips",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 100001, 8, 5e-6, 0.01}},
    {"cars_2view",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 800001, 8, 5e-5, 0, 2, 5}},
    {"cars_priors",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 800001, 8, 5e-5, 0, 1, 4, true, true}},
    {"cars_priors_depth",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 800001, 8, 5e-5, 0, 1, 4, true, false}},
    {"cars_priors_normal",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 800001, 8, 5e-5, 0, 1, 4, false, true}},
    {"cars_priors_lora",
     {0.8F, 1.8F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -3, 1e-3F, 10000, 8, 5e-5, 0, 1, 4, true, true}},
    {"chairs",
     {1.25F, 2.75F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -2, 1e-3F, 800001, 8, 5e-5, 0}},
    {"chairs_lpips",
     {1.25F, 2.75F, kShapeNet, true, 128, 16, 1e-6F, 1e-3F, -2, 1e-3F, 200001, 8, 5e-6, 0.01}},
    {"hydrants",
     {-2, 2, 0, false, 128, 16, 0.1F, 1, -2, 3e-3F, 800001, 8, 5e-5, 0}},
    {"hydrants_lpips",
     {-2, 2, 0, false, 128, 16, 0.1F, 1, -2, 3e-3F, 100001, 8, 5e-6, 0.01}},
    {"teddybears",
     {-2, 2, 0, false, 128, 16, 0.1F, 1, -2, 3e-3F, 800001, 8, 5e-5, 0}},
    {"teddybears_lpips",
     {-2, 2, 0, false, 128, 16, 0.1F, 1, -2, 3e-3F, 100001, 8, 5e-6, 0.01}},
    {"nmr",
     {1.2F, 4, kNmr, true, 64, 8, 0.1F, 1, -2, 3e-3F, 1240001, 32, 5e-5, 0}},
    {"nmr_lpips",
     {1.2F, 4, kNmr, true, 64, 8, 0.1F, 1, -2, 3e-3F, 150001, 32, 5e-6, 0.01}},
    {"objaverse",
     {0.8F, 3.2F, kZero123, true, 128, 16, 0.1F, 1, -2, 0.01F, 350001, 32, 5e-5, 0}},
    {"objaverse_lpips",
     {0.8F, 3.2F, kZero123, true, 128, 16, 0.1F, 1, -2, 0.01F, 40001, 32, 6.3e-5, 0.34}},
    {"gso",
     {0.8F, 3.2F, kZero123, true, 128, 16, 0.1F, 1, -2, 0.01F, 350001, 32, 5e-5, 0}},
};
// clang-format on

config::Settings settings_of(const config::Preset& preset) {
    const auto config = need(read_yaml_config(preset.text, std::string(preset.name)));
    const auto made = config::settings_of(config);
    EXPECT_OK(made) << preset.name;
    return made.value();
}

bool is_of_another_project(const config::Preset& preset) {
    return settings_of(preset).network.positions != kHeadRayDepth;
}

TEST(Presets, AreThePublishedConfigurations) {
    std::size_t found = 0;
    for (const config::Preset& preset : config::presets()) {
        SCOPED_TRACE(std::string(preset.name));
        if (preset.name == "small" || is_of_another_project(preset)) continue;
        ++found;
        ASSERT_TRUE(kPublished.contains(std::string(preset.name)));
        const Published& p = kPublished.at(std::string(preset.name));
        const config::Settings s = settings_of(preset);
        const config::ModelConfig& n = s.network;
        const config::TrainConfig& t = s.training;
        EXPECT_EQ(std::tuple(n.znear, n.zfar, n.fov_degrees, n.resolution),
                  std::tuple(p.znear, p.zfar, p.fov, p.resolution));
        EXPECT_EQ(n.attention_resolutions, std::vector<std::uint32_t>{p.attention});
        EXPECT_EQ(std::tuple(n.init_depth.scale, n.init_depth.bias, n.init_offset.scale,
                             n.init_offset.bias),
                  std::tuple(1.0F, 0.0F, p.xyz_scale, 0.0F));
        EXPECT_EQ(std::tuple(n.init_opacity.scale, n.init_opacity.bias, n.init_scale.scale,
                             n.init_scale.bias),
                  std::tuple(p.opacity_scale, p.opacity_bias, p.scale_scale, 0.02F));
        EXPECT_EQ(std::tuple(n.views, n.depth, n.normal, n.mask, n.origin_distance),
                  std::tuple(p.views, p.depth, p.normal, false, p.fov == 0));
        EXPECT_EQ(n.embedding == config::Embedding::kPose, p.views == 2);
        EXPECT_EQ(std::tuple(t.iterations, t.batch_size, t.targets, t.white_background),
                  std::tuple(p.iterations, p.batch, p.targets, p.white));
        EXPECT_EQ(std::tuple(t.learning_rate, t.lpips_weight, t.betas[0], t.betas[1]),
                  std::tuple(p.rate, p.lpips, 0.9, 0.999));
        EXPECT_EQ(t.scale_terms, p.fov == 0);
        EXPECT_EQ(std::tuple(n.base_dim, n.num_blocks, n.sh_degree, n.cross_view_attention),
                  std::tuple(128U, 4U, 1U, true));
        const bool lora = preset.name == "cars_priors_lora";
        EXPECT_EQ(n.lora.rank, lora ? config::kPublishedRank : 0);
        EXPECT_EQ(n.lora.alpha, lora ? 8.0F : config::LoraConfig().alpha);
        EXPECT_EQ(t.validate_every, lora ? 1000U : 10000U);
        EXPECT_EQ(preset.name.substr(0, preset.name.find('_')),
                  t.category == "cars_priors" ? "cars" : t.category);
    }
    EXPECT_EQ(found, kPublished.size());
}

/// W-Ted/F3D-Gaus 8e52aec: its configuration for ImageNet at 256 pixels, and its predictor.
TEST(Presets, F3dGausIsThePublishedOne) {
    const config::Settings s = settings_of(need(config::preset_of("f3d-gaus-256")));
    const config::ModelConfig& n = s.network;
    EXPECT_EQ(n.positions, kHeadInputDepth);
    EXPECT_TRUE(n.depth_farther);
    EXPECT_EQ(std::tuple(n.znear, n.zfar, n.fov_degrees, n.resolution, n.names_resolution()),
              std::tuple(6.667F, 8.667F, 13.164F, 256U, 128U));
    EXPECT_EQ(std::tuple(n.image_channels(), n.input_channels(), n.output_channels()),
              std::tuple(4U, 5U, 23U));
    EXPECT_EQ(std::tuple(n.num_blocks, n.init_scale.scale, n.init_scale.bias),
              std::tuple(3U, 0.0005F, 0.01F));
    EXPECT_FALSE(s.training.white_background);
}

/// What a step costs, by the multiplications of a convolution of each level, beside that of the published cars model;
/// 1000 steps of 800001.
TEST(Presets, SmallEndsWithinMinutes) {
    const auto small = need(config::preset_of("small")), cars = need(config::preset_of("cars"));
    const auto cost = [](const config::Settings& s) {
        return static_cast<double>(s.training.iterations) * s.training.batch_size *
               s.network.num_blocks *
               std::pow(static_cast<double>(s.network.base_dim) * s.network.resolution, 2);
    };
    EXPECT_LT(cost(settings_of(small)), 1e-5 * cost(settings_of(cars)));
    EXPECT_TRUE(settings_of(small).training.white_background);
}

/// A training of a preset says only what its user must add, or what holds of the published one as well.
TEST(Presets, WarnOfWhatTheyLack) {
    for (const config::Preset& preset : config::presets()) {
        const auto config = need(read_yaml_config(preset.text, "x"));
        const auto found = config::training_warnings(config);
        ASSERT_OK(found) << preset.name;
        const std::string category = settings_of(preset).training.category;
        const bool lists =
            category == "hydrants" || category == "teddybears" || category == "objaverse";
        const bool adapters = preset.name == "cars_priors_lora";
        ASSERT_EQ(found.value().size(), lists || adapters ? 1U : 0U) << preset.name;
        if (lists) {
            EXPECT_HAS(found.value()[0], "_file' is empty");
        }
    }
}

TEST(Presets, AreListedAndFound) {
    const std::string json = config::presets_json();
    EXPECT_HAS(json, R"("name": "chairs", "about": "ShapeNet-SRN chairs from one view)");
    EXPECT_EQ(need(config::preset_of("cars")).name, "cars");
    for (const char* name : {"", "car", "cars.yaml", "CARS"})
        EXPECT_ERROR(config::preset_of(name), Code::kInvalidArgument,
                     "there are: cars, cars_2view,");
}

}  // namespace
}  // namespace splat::test
