#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "io/sample_scene.h"
#include "scene/activate.h"
#include "scene/sh.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using test::sample_scene;

TEST(SplatFile, ReadsTheLayout) {
    Buffer file;
    for (const float value : {1.0F, -2.0F, 3.0F, 0.5F, 1.0F, 2.0F}) put(file, value);
    for (const int value : {255, 0, 128, 51, 228, 128, 28, 128})
        put(file, static_cast<std::uint8_t>(value));
    const auto g = need(read_splat(file)).gaussians;
    EXPECT_EQ(g.means, (std::vector<float>{1, -2, 3}));
    EXPECT_NEAR(g.log_scales[0], std::log(0.5), 1e-6);
    EXPECT_NEAR(g.sh[0], 0.5 / scene::kSh0, 1e-6);
    EXPECT_NEAR(g.sh[1], -0.5 / scene::kSh0, 1e-6);
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.2 / 0.8), 1e-6);
    const double length = std::hypot(100.0, 100.0);
    EXPECT_NEAR(g.rotations[0], 100 / length, 1e-6);
    EXPECT_NEAR(g.rotations[2], -100 / length, 1e-6);
}

TEST(SplatFile, RoundTripIsWithinTheQuantisation) {
    auto scene = sample_scene(300, 0);
    const auto file = need(write_splat(scene));
    EXPECT_EQ(file.size(), 300U * 32U);
    const auto g = need(read_splat(file)).gaussians;
    EXPECT_EQ(g.means, scene.means);
    EXPECT_LT(test::max_difference(g.log_scales, scene.log_scales), 1e-6);
    // The colour 0.5 + kSh0 sh and the opacity are within half a step of 1/255.
    EXPECT_LT(test::max_difference(g.sh, scene.sh), 0.5 / 255 / scene::kSh0 + 1e-6);
    for (std::size_t i = 0; i < scene.count(); ++i)
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(g.opacity_logits[i])),
                    scene::opacity_of(static_cast<double>(scene.opacity_logits[i])),
                    0.5 / 255 + 1e-6);
    // Half a step of 1/128 (a whole one at +1) in four components: an angle below 2 * 2 * that.
    EXPECT_LT(test::max_angle(g.rotations, scene.rotations), 4.0 / 128);
}

TEST(SplatFile, RotationsOfAnyLengthAreWrittenAlike) {
    auto scene = sample_scene(20, 0);
    const auto file = need(write_splat(scene));
    for (const float length : {4.0F, 0.125F}) {
        auto scaled = scene;
        for (float& component : scaled.rotations) component *= length;
        EXPECT_EQ(need(write_splat(scaled)), file) << length;
    }
}

TEST(SplatFile, FullAndNoOpacityStayFinite) {
    auto scene = sample_scene(2, 0);
    scene.opacity_logits = {1000.0F, -1000.0F};
    const auto loaded = need(read_splat(need(write_splat(scene))));
    EXPECT_EQ(loaded.gaussians.opacity_logits, (std::vector<float>{40, -40}));
    EXPECT_EQ(loaded.report.non_finite_values, 0U);
}

TEST(SplatFile, CountsScalesThatHaveNoLogarithm) {
    auto file = need(write_splat(sample_scene(1, 0)));
    for (std::size_t i = 12; i < 16; ++i) file[i] = std::byte{0};
    EXPECT_EQ(need(read_splat(file)).report.non_finite_values, 1U);
}

TEST(SplatFile, RefusesOtherLengths) {
    const auto file = need(write_splat(sample_scene(1, 0)));
    for (std::size_t size = 1; size < 32; ++size)
        EXPECT_ERROR(read_splat(Bytes(file).first(size)), Code::kFormat, "multiple of 32");
    EXPECT_EQ(need(read_splat({})).gaussians.count(), 0U);
    test::parse_damaged(file, [](Bytes bytes) { return read_splat(bytes).ok(); });
}

TEST(SplatFile, RefusesToWriteWhatBytesCannotHold) {
    auto scene = sample_scene(3, 1);
    scene.rotations[5] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(write_splat(scene), Code::kInvalidArgument, "Gaussian 1");
    for (const auto& [value, text] : {std::pair{90.0F, "90"}, {-110.0F, "-110"}}) {
        auto scaled = sample_scene(3, 0);
        scaled.log_scales[8] = value;
        EXPECT_ERROR(write_splat(scaled), Code::kInvalidArgument,
                     ("Gaussian 2 has a log scale of " + std::string(text)).c_str());
    }
    auto most = sample_scene(1, 0);
    most.log_scales = {88.0F, -100.0F, -std::numeric_limits<float>::infinity()};
    EXPECT_OK(write_splat(most));
}

}  // namespace
}  // namespace splat::io
