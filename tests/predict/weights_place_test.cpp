#include "predict/weights_place.h"

#include <gtest/gtest.h>

#include "support/decimal_comma.h"
#include "support/expect_status.h"
#include "synthetic/sample_folder.h"

namespace splat::predict {
namespace {

TEST(WeightsPlace, FindsBuiltInWeightsOfTheBuildFolder) {
    const auto path = need(builtin_weights(kDefaultWeights));
    EXPECT_TRUE(path.ends_with("tools/weights/cars64/weights.safetensors"));
    EXPECT_TRUE(need(config_beside(path)).ends_with("cars64/config.json"));
    const auto maps = need(builtin_weights("cars64-depth-normal"));
    EXPECT_TRUE(maps.ends_with("tools/weights/cars64-depth-normal/weights.safetensors"));
    EXPECT_TRUE(need(config_beside(maps)).ends_with("cars64-depth-normal/config.json"));
}

TEST(WeightsPlace, TakesNamesWhereNoFileIsCalledSo) {
    EXPECT_EQ(weights_named("cars64").value(), builtin_weights("cars64").value());
    for (const char* path : {"gone.pth", "folder/cars64", "./cars64", ""})
        EXPECT_EQ(weights_named(path).value(), path) << "a path: whoever reads it refuses it";
    EXPECT_ERROR(weights_named("cars"), Code::kNotFound, "there is no file 'cars'");
    EXPECT_ERROR(weights_named("cars"), Code::kNotFound, "expected cars64, cars64-depth-normal");
    const test::SampleFolder folder;
    const auto before = std::filesystem::current_path();
    test::put_text(folder / "cars64", "a file of the caller's");
    std::filesystem::current_path(folder.path());
    EXPECT_EQ(weights_named("cars64").value(), "cars64");
    std::filesystem::current_path(before);
}

TEST(WeightsPlace, PrefersThoseOfThePrefixOfAnInstalledLibrary) {
    const test::SampleFolder folder;
    const auto prefix = folder / "prefix";
    test::put_text(prefix / "share/libsplat/weights/small/weights.safetensors", "1");
    test::put_text(prefix / "share/libsplat/weights/other/weights.safetensors", "1");
    test::put_text(prefix / "share/libsplat/weights/empty/README.md", "1");
    test::put_text(prefix / "tools/weights/small/weights.safetensors", "1");
    for (const char* library : {"lib", "lib/x86_64-linux-gnu"}) {
        const auto path = need(builtin_weights_near((prefix / library).string(), "small"));
        EXPECT_EQ(path, prefix / "share/libsplat/weights/small/weights.safetensors");
    }
    for (const char* name : {"large", "", "..", "small/../small", "empty"})
        EXPECT_ERROR(builtin_weights_near((prefix / "lib").string(), name), Code::kNotFound,
                     "expected other, small");
    EXPECT_ERROR(builtin_weights_near("/nonexistent/lib", "small"), Code::kNotFound, "no others");
}

TEST(WeightsPlace, FindsTheConfigurationBesideWeights) {
    const test::SampleFolder folder;
    const std::string weights = (folder / "weights.npz").string();
    EXPECT_ERROR(config_beside(weights), Code::kNotFound, "no config.json or config.yaml");
    test::put_text(folder / "config.yaml", "{}");
    EXPECT_EQ(config_beside(weights).value(), folder / "config.yaml");
    test::put_text(folder / "config.json", "{}");
    EXPECT_EQ(config_beside(weights).value(), folder / "config.json");
    const std::filesystem::path named = std::filesystem::path(weights).replace_extension(".json");
    test::put_text(named, "{}");
    EXPECT_EQ(config_beside(weights).value(), named) << "that of these weights comes first";
    const std::string adapters = (folder / "other" / "chairs.safetensors").string();
    EXPECT_EQ(config_beside(weights, adapters).value(), named) << "the adapters have none";
    test::put_text(folder / "other" / "chairs.json", "{}");
    EXPECT_EQ(config_beside(weights, adapters).value(), folder / "other" / "chairs.json");
}

TEST(WeightsPlace, ReadsNetworkAndTraining) {
    const auto settings = need(settings_of(
        "data:\n  training_resolution: 32\n  category: chairs\nopt:\n  base_lr: 1.0e-3\n", "file"));
    EXPECT_EQ(settings.network.resolution, 32U);
    EXPECT_EQ(settings.training.category, "chairs");
    EXPECT_EQ(settings.training.learning_rate, 1e-3);
    EXPECT_ERROR(settings_of("data: [", "file"), Code::kInvalidArgument, "file");
}

TEST(WeightsPlace, TakesTheAlphaOfAdaptersFromTheirFile) {
    config::ModelConfig network;
    io::WeightsFile adapters;
    EXPECT_ERROR(adapters_alpha(adapters, network), Code::kInvalidArgument, "neither");
    network.lora.rank = 2;
    network.lora.alpha = 3;
    EXPECT_EQ(adapters_alpha(adapters, network).value(), 3);
    adapters.metadata = {{"lora_alpha", "0.5"}};
    EXPECT_EQ(adapters_alpha(adapters, network).value(), 0.5);
    adapters.metadata = {{"lora_alpha", "half"}};
    EXPECT_ERROR(adapters_alpha(adapters, network), Code::kFormat, "'half'");
}

TEST(WeightsPlace, TakesTheAlphaOfAdaptersInAnyLocale) {
    const test::DecimalComma comma;
    if (!comma) GTEST_SKIP() << "no locale with decimal commas: install locales";
    io::WeightsFile adapters;
    adapters.metadata = {{"lora_alpha", "0.5"}};
    EXPECT_EQ(adapters_alpha(adapters, {}).value(), 0.5);
}

TEST(WeightsPlace, TellsTheFieldOfViewOfARayGrid) {
    io::NamedTensors tensors;
    EXPECT_FALSE(field_of_view(tensors));
    // A pixel's middle lies half a pixel from the edge: 0.5 = 1 / 2 of x / f at the edge.
    ASSERT_OK(
        tensors.add({"ray_dirs", {1, 3, 1, 2}, io::NumberType::kF32, {-0.5F, 0.5F, 0, 0, 1, 1}}));
    const auto fov = field_of_view(tensors);
    ASSERT_TRUE(fov);
    EXPECT_NEAR(*fov, 90, 1e-9);
}

}  // namespace
}  // namespace splat::predict
