// Scenes drawn as their files say: what a scene keeps of it, in one call, by rasterizers, in linear colours.
#include <cmath>
#include <string>
#include <vector>

#include "api/raster_calls.h"
#include "ref/images/srgb_ref.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kWidth = 21, kHeight = 18, kPixelCount = kWidth * kHeight;
constexpr std::uint32_t kEveryWay = SPLAT_DRAWN_ANTIALIASED | SPLAT_DRAWN_BY_DISTANCE |
                                    SPLAT_DRAWN_CUT_3_SIGMA | SPLAT_DRAWN_LINEAR_COLORS;
constexpr float kBackground[3] = {0.5F, 0.03F, 1};

/// Opaque Gaussians large enough to overlap and to reach beyond 3 sigma, in a wide view.
Scene scene_of(std::uint32_t drawn_as) {
    SampleScene sample(60, 1);
    for (float& logit : sample.opacity_logits) logit = 6;
    for (float& scale : sample.log_scales) scale -= 0.5F;
    splat_scene_desc desc = sample.desc();
    desc.drawn_as = drawn_as;
    return got(splat_scene_create, &desc);
}

splat_camera wide_camera() {
    splat_camera camera = sample_camera(kWidth, kHeight, 0.4);
    camera.fx *= 0.5;
    camera.fy *= 0.5;
    camera.world_to_camera[11] -= 2.5;
    return camera;
}

splat_scene_render_desc render_desc(std::uint32_t flags = 0, std::uint32_t as_given = 0) {
    auto desc = sized<splat_scene_render_desc>();
    desc.flags = flags;
    desc.as_given = as_given;
    std::copy_n(kBackground, 3, desc.background);
    return desc;
}

/// RGB and alpha.
template <class Value>
std::vector<Value> rendered(splat_scene scene, const splat_scene_render_desc& desc) {
    std::vector<Value> values(std::size_t{4} * kPixelCount);
    splat_image image{};
    image.pixels = values.data();
    image.bytes = values.size() * sizeof(Value);
    image.type = sizeof(Value) == 1 ? SPLAT_PIXEL_U8 : SPLAT_PIXEL_F32;
    image.width = kWidth;
    image.height = kHeight;
    image.channels = 4;
    const splat_camera camera = wide_camera();
    EXPECT_DONE(splat_scene_render(scene, shared_device(), &camera, 1, &desc, &image));
    return values;
}

/// Scenes keep it when they are changed; merged ones have that of the first.
TEST(ApiDrawnAs, AScenesBits) {
    EXPECT_EQ(info_of(scene_of(0)).drawn_as, 0U);
    for (const std::uint32_t bit : {SPLAT_DRAWN_ANTIALIASED, SPLAT_DRAWN_BY_DISTANCE,
                                    SPLAT_DRAWN_CUT_3_SIGMA, SPLAT_DRAWN_LINEAR_COLORS})
        EXPECT_EQ(info_of(scene_of(bit)).drawn_as, bit);
    const Scene scene = scene_of(kEveryWay);
    const double low[3] = {-1, -1, -1}, high[3] = {1, 1, 1};
    EXPECT_DONE(splat_scene_crop(scene, low, high));
    EXPECT_DONE(splat_scene_filter(scene, SPLAT_FILTER_FINITE | SPLAT_FILTER_SORT, 0.1));
    EXPECT_EQ(info_of(scene).drawn_as, kEveryWay);
    const Scene other = scene_of(SPLAT_DRAWN_ANTIALIASED);
    const splat_scene both[] = {scene, other};
    Scene merged;
    EXPECT_DONE(splat_scene_merge(both, 2, merged.out()));
    EXPECT_EQ(info_of(merged).drawn_as, kEveryWay);
}

/// A struct of before the bits gets what it had.
TEST(ApiDrawnAs, AnOlderInfoIsFilled) {
    const Scene scene = scene_of(kEveryWay);
    splat_scene_info info{};
    info.struct_size = offsetof(splat_scene_info, drawn_as);
    info.drawn_as = 7;
    EXPECT_DONE(splat_scene_get_info(scene, &info));
    EXPECT_EQ(info.count, 60U);
    EXPECT_EQ(info.drawn_as, 7U);
}

TEST(ApiDrawnAs, RenderDrawsAsTheSceneSays) {
    const Scene plain = scene_of(0);
    const std::vector<float> usual = rendered<float>(plain, render_desc());
    for (const std::uint32_t bit : {SPLAT_DRAWN_ANTIALIASED, SPLAT_DRAWN_BY_DISTANCE,
                                    SPLAT_DRAWN_CUT_3_SIGMA, SPLAT_DRAWN_LINEAR_COLORS}) {
        const Scene scene = scene_of(bit);
        const std::vector<float> drawn = rendered<float>(scene, render_desc());
        EXPECT_NE(drawn, usual) << bit;
        EXPECT_EQ(drawn, rendered<float>(plain, render_desc(bit))) << bit;
        EXPECT_EQ(rendered<float>(scene, render_desc(0, 1)), usual) << bit << ": flags alone";
        EXPECT_EQ(rendered<float>(scene, render_desc(bit, 1)), drawn) << bit;
    }
}

/// Blended linear over the background made linear, then converted; alpha stays.
TEST(ApiDrawnAs, LinearColorsBecomeSrgb) {
    const Scene scene = scene_of(SPLAT_DRAWN_LINEAR_COLORS);
    auto desc = rasterizer_desc(60, kWidth, kHeight, SPLAT_RASTERIZER_LINEAR_COLORS);
    desc.sh_degree = 1;
    const Rasterizer rasterizer = make_rasterizer(shared_device(), desc);
    ASSERT_DONE(draw(rasterizer, scene, wide_camera(), kBackground));
    const Floats linear = output(rasterizer, SPLAT_OUTPUT_RGB, std::size_t{3} * kPixelCount);
    const Floats alpha = output(rasterizer, SPLAT_OUTPUT_ALPHA, kPixelCount);
    const std::vector<float> drawn = rendered<float>(scene, render_desc());
    const auto bytes = rendered<std::uint8_t>(scene, render_desc());
    std::size_t empty = 0, far = 0;
    for (std::size_t p = 0; p < kPixelCount; ++p) {
        EXPECT_EQ(drawn[4 * p + 3], alpha[p]);
        empty += alpha[p] == 0 ? 1 : 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const auto value = static_cast<double>(linear[3 * p + c]);
            const double expected = ref::srgb_of_linear(value);
            EXPECT_NEAR(static_cast<double>(drawn[4 * p + c]), expected, 2e-7 * (1 + expected));
            far += std::abs(expected - value) > 0.05 ? 1 : 0;
            const double level = std::min(255 * expected, 255.0);
            EXPECT_NEAR(bytes[4 * p + c], level, 0.501);
            if (alpha[p] != 0) continue;
            const auto given = static_cast<double>(kBackground[c]);
            EXPECT_NEAR(value, ref::linear_of_srgb(given), 1e-7);
            EXPECT_NEAR(static_cast<double>(drawn[4 * p + c]), given, 1e-6);
        }
    }
    EXPECT_GT(empty, 0U);
    EXPECT_LT(empty, kPixelCount / 2);
    EXPECT_GT(far, kPixelCount / 2) << "the two differ";
}

/// Other outputs have no colours.
TEST(ApiDrawnAs, OnlyColorsAreConverted) {
    splat_scene_render_desc desc = render_desc();
    for (const splat_output which : {SPLAT_OUTPUT_ALPHA, SPLAT_OUTPUT_NORMALS}) {
        const std::uint32_t channels = which == SPLAT_OUTPUT_ALPHA ? 1 : 3;
        Floats plain(std::size_t{channels} * kPixelCount), linear = plain;
        desc.output = which;
        for (Floats* values : {&plain, &linear}) {
            splat_image image{};
            image.pixels = values->data();
            image.bytes = values->size() * sizeof(float);
            image.type = SPLAT_PIXEL_F32;
            image.width = kWidth;
            image.height = kHeight;
            image.channels = channels;
            const Scene scene = scene_of(values == &plain ? 0 : SPLAT_DRAWN_LINEAR_COLORS);
            const splat_camera camera = wide_camera();
            ASSERT_DONE(splat_scene_render(scene, shared_device(), &camera, 1, &desc, &image));
        }
        EXPECT_EQ(plain, linear);
    }
}

/// A rasterizer draws as it was made; the log tells once of a scene that wants it otherwise.
TEST(ApiDrawnAs, ARasterizerThatLacksABitWarnsOnce) {
    static std::vector<std::string> warnings;
    warnings.clear();
    ASSERT_DONE(splat_log_set_callback(
        [](void*, splat_log_level, const char* text) { warnings.emplace_back(text); }, nullptr,
        SPLAT_LOG_WARNING));
    const Scene scene = scene_of(kEveryWay), other = scene_of(kEveryWay);
    const Rasterizer plain = make_rasterizer(
        shared_device(), rasterizer_desc(60, kWidth, kHeight, SPLAT_RASTERIZER_CUT_3_SIGMA));
    const Rasterizer made =
        make_rasterizer(shared_device(), rasterizer_desc(60, kWidth, kHeight, kEveryWay));
    EXPECT_DONE(draw(made, scene, wide_camera()));
    EXPECT_EQ(warnings.size(), 0U);
    EXPECT_DONE(draw(plain, scene, wide_camera()));
    EXPECT_DONE(draw(plain, scene, wide_camera()));
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("antialiased, by distance, linear colours, which"),
              std::string::npos)
        << warnings[0];
    EXPECT_DONE(draw(plain, other, wide_camera()));
    EXPECT_EQ(warnings.size(), 2U);
    EXPECT_DONE(draw(plain, scene_of(0), wide_camera()));
    rendered<float>(scene_of(kEveryWay), render_desc(0, 1));
    EXPECT_EQ(warnings.size(), 2U);
    listen_to_log();
}

}  // namespace
}  // namespace splat::test
