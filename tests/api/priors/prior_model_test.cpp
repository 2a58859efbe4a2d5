// Models through the C API. Needs ONNX Runtime: run by tests/interop/onnx.sh.

#include <algorithm>
#include <cmath>

#include "api/api_calls.h"
#include "prior_models/onnx/sample_models.h"
#include "support/system.h"

namespace splat::test {
namespace {

PriorModel make_prior_model(const char* preset, std::uint32_t flags = 0) {
    const std::string path = testing::TempDir() + "api_" + preset + ".onnx";
    sample_model(preset).save(path);
    auto desc = sized<splat_prior_model_desc>();
    desc.preset = preset;
    desc.model_path = path.c_str();
    desc.threads = 1;
    desc.flags = flags;
    return got(splat_prior_model_create, &desc);
}

std::vector<std::uint8_t> wavy_bytes(std::uint32_t channels) {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 20 * 16; ++i)
        for (std::uint32_t c = 0; c < channels; ++c)
            bytes.push_back(static_cast<std::uint8_t>(120 + 100 * std::sin(0.37 * i + c)));
    return bytes;
}

/// All maps of a picture of 20 x 16 pixels.
struct AllMaps {
    Floats depth = Floats(320, -9);
    Floats normal = Floats(960, -9);
    std::vector<std::uint8_t> mask = std::vector<std::uint8_t>(320, 9);

    splat_prior_maps maps() {
        return {packed_image(depth, 20, 16, 1), packed_image(normal, 20, 16, 3),
                packed_image(mask, 20, 16, 1)};
    }
    bool operator==(const AllMaps&) const = default;
};

TEST(ApiPriorModel, DescribesItself) {
    const PriorModel model = make_prior_model("u2net");
    const auto info = got(splat_prior_model_get_info, model);
    EXPECT_EQ(info.maps, static_cast<std::uint32_t>(SPLAT_DATA_MASK));
    EXPECT_EQ(info.width, 320U);
    EXPECT_EQ(info.height, 320U);
    EXPECT_STREQ(info.preset, "u2net");
    EXPECT_TRUE(holds(info.licence, "Apache-2.0"));
    EXPECT_TRUE(holds(info.path, "api_u2net.onnx"));
    EXPECT_TRUE(holds(info.runtime_version, "."));
}

TEST(ApiPriorModel, FillsEveryMapOfSeveralPicturesInOnePass) {
    const PriorModel model = make_prior_model("moge-2-vits");
    std::vector<std::uint8_t> rgb = wavy_bytes(3), rgba;
    for (std::size_t i = 0; i < 320; ++i)
        rgba.insert(rgba.end(), {rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], 7});
    const splat_image pictures[] = {packed_image(rgb, 20, 16, 3), packed_image(rgba, 20, 16, 4)};
    AllMaps first, second;
    const splat_prior_maps maps[] = {first.maps(), second.maps()};
    EXPECT_DONE(splat_prior_model_run(model, pictures, maps, 2));
    EXPECT_EQ(first, second) << "alpha is left out";
    for (const float value : first.depth) EXPECT_TRUE(value >= 0 && value <= 1);
    EXPECT_EQ(*std::max_element(first.depth.begin(), first.depth.end()), 1);
    for (std::size_t i = 0; i < 320; ++i) {
        double length = 0;
        for (std::size_t c = 0; c < 3; ++c) length += std::pow(2 * first.normal[3 * i + c] - 1, 2);
        EXPECT_NEAR(length, 1, 1e-5);
        EXPECT_TRUE(first.mask[i] == 0 || first.mask[i] == 255);
    }
    // Only the mask, with others' pixels untouched.
    AllMaps third;
    splat_prior_maps only = third.maps();
    only.depth.pixels = only.normal.pixels = nullptr;
    EXPECT_DONE(splat_prior_model_run(model, pictures, &only, 1));
    EXPECT_EQ(third.mask, first.mask);
    EXPECT_EQ(third.depth[0], -9);
}

TEST(ApiPriorModel, GivesTheModelsNumbersIfAsked) {
    const PriorModel model = make_prior_model("midas-small-hub", SPLAT_PRIOR_MODEL_NUMBERS);
    const PriorModel unit = make_prior_model("midas-small-hub");
    std::vector<std::uint8_t> rgb = wavy_bytes(3);
    const splat_image picture = packed_image(rgb, 20, 16, 3);
    Floats numbers(320), units(320);
    splat_prior_maps maps{};
    maps.depth = packed_image(numbers, 20, 16, 1);
    EXPECT_DONE(splat_prior_model_run(model, &picture, &maps, 1));
    maps.depth = packed_image(units, 20, 16, 1);
    EXPECT_DONE(splat_prior_model_run(unit, &picture, &maps, 1));
    const auto [least, most] = std::minmax_element(numbers.begin(), numbers.end());
    EXPECT_GT(*most - *least, 1.5) << "not from 0 to 1";
    for (std::size_t i = 0; i < 320; ++i)
        EXPECT_NEAR(units[i], (numbers[i] - *least) / (*most - *least), 1e-6);
}

TEST(ApiPriorModel, LeavesMapsUntouchedWhenItFails) {
    const PriorModel model = make_prior_model("moge-2-vits");
    std::vector<std::uint8_t> rgb = wavy_bytes(3);
    const splat_image pictures[] = {packed_image(rgb, 20, 16, 3), packed_image(rgb, 20, 16, 3)};
    AllMaps first, second;
    const AllMaps before;
    splat_prior_maps maps[] = {first.maps(), second.maps()};
    maps[1].normal.channels = 1;
    EXPECT_REFUSED(splat_prior_model_run(model, pictures, maps, 2), kShape, "maps[1].normal");
    maps[1] = second.maps();
    maps[1].depth.width = 19;
    EXPECT_REFUSED(splat_prior_model_run(model, pictures, maps, 2), kShape, "maps[1].depth");
    maps[1] = {};
    EXPECT_REFUSED(splat_prior_model_run(model, pictures, maps, 2), kArgument, "no map");
    EXPECT_EQ(first, before);
    EXPECT_EQ(second, before);
}

TEST(ApiPriorModel, AForkedChildIsRefused) {
    SPLAT_NEED_FORK();
    const PriorModel model = make_prior_model("u2net");
    const auto refused = [&] {
        std::vector<std::uint8_t> rgb(20 * 16 * 3, 9), mask(320);
        const splat_image picture = packed_image(rgb, 20, 16, 3);
        splat_prior_maps maps{};
        maps.mask = packed_image(mask, 20, 16, 1);
        const splat_result result = splat_prior_model_run(model, &picture, &maps, 1);
        return result == kState ? 0 : 1;
    };
    EXPECT_EQ(in_child(refused), 0);
}

TEST(ApiPriorModel, SaysWhatIsWrongWithAModel) {
    const std::string path = testing::TempDir() + "api_other.onnx";
    sample_model("midas-small").save(path);
    auto desc = sized<splat_prior_model_desc>();
    desc.preset = "normal-uncertainty-nyu";
    desc.model_path = path.c_str();
    PriorModel model;
    EXPECT_REFUSED(splat_prior_model_create(&desc, model.out()), kFormat, "is float32 [?,?,?]");
    desc.model_path = "/nowhere/model.onnx";
    EXPECT_REFUSED(splat_prior_model_create(&desc, model.out()), kNotFound, "/nowhere/model.onnx");
}

}  // namespace
}  // namespace splat::test
