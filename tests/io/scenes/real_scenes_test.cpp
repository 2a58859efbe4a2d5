// Files of other programs, which are not in the repository.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "io/file.h"
#include "io/sample_scene.h"
#include "io/scene_file.h"
#include "scene/activate.h"
#include "scene/sh.h"
#include "support/expect_status.h"
#include "support/real_data.h"

namespace splat::io {
namespace {

Result<LoadedScene> load_real(const std::string& name) {
    SPLAT_ASSIGN(const Buffer file, io::read_file(*test::real_data_folder() + "/" + name));
    return read_scene(file, name);
}

TEST(RealScenes, FourGaussiansOfSplatTransform) {
    SPLAT_NEEDS_REAL_DATA();
    const struct {
        const char* name;
        const char* format;
        std::uint32_t version;
    } files[] = {{"minimal.splat", "splat", 0}, {"minimal.ksplat", "ksplat", 1},
                 {"minimal-raw.spz", "spz", 2}, {"minimal-v2.spz", "spz", 2},
                 {"minimal-v3.spz", "spz", 3},  {"minimal-v4.spz", "spz", 4}};
    for (const auto& file : files) {
        SCOPED_TRACE(file.name);
        const auto loaded = need(load_real(std::string("format_fixtures/") + file.name));
        const LoadReport& report = loaded.report;
        EXPECT_EQ(report.format, file.format);
        EXPECT_EQ(report.version, file.version);
        EXPECT_EQ(report.count, 4U);
        EXPECT_EQ(report.sh_degree, 0U);
        EXPECT_EQ(report.non_finite_values + report.bad_rotations, 0U);
        EXPECT_TRUE(report.ignored.empty());
        for (const float logit : loaded.gaussians.opacity_logits)
            EXPECT_NEAR(scene::opacity_of(static_cast<double>(logit)), 0.9, 0.005);
        for (const float value : loaded.gaussians.log_scales)
            EXPECT_NEAR(value, std::log(0.1), 1.0 / 32 + 1e-6);
    }
}

TEST(RealScenes, ThreeGaussiansInThreeFormatsAgree) {
    SPLAT_NEEDS_REAL_DATA();
    const std::string stem = "format_fixtures/test-splat.3-points-from-train.";
    const auto ply = need(load_real(stem + "ply"));
    const auto splat = need(load_real(stem + "splat"));
    const auto& expected = ply.gaussians;
    ASSERT_EQ(expected.count(), 3U);
    EXPECT_EQ(expected.sh_degree, 3U);
    // The .splat holds the same three in another order.
    const auto& got = splat.gaussians;
    for (std::size_t i = 0; i < 3; ++i) {
        std::size_t match = 3;
        for (std::size_t j = 0; j < 3; ++j)
            if (std::equal(got.means.begin() + static_cast<std::ptrdiff_t>(3 * i),
                           got.means.begin() + static_cast<std::ptrdiff_t>(3 * i + 3),
                           expected.means.begin() + static_cast<std::ptrdiff_t>(3 * j)))
                match = j;
        ASSERT_LT(match, 3U) << "mean of Gaussian " << i;
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(got.log_scales[i * 3 + k], expected.log_scales[match * 3 + k], 1e-5);
        // The writer of that file truncates where we round: a whole step.
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(got.opacity_logits[i])),
                    scene::opacity_of(static_cast<double>(expected.opacity_logits[match])),
                    1.0 / 255);
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_NEAR(scene::kSh0 * static_cast<double>(got.sh[i * 3 + k]),
                        std::clamp(scene::kSh0 * static_cast<double>(expected.sh[match * 48 + k]),
                                   -0.5, 0.5),
                        1.01 / 255);
    }
}

TEST(RealScenes, ThreeGaussiansOfSpzAgree) {
    SPLAT_NEEDS_REAL_DATA();
    const std::string stem = "format_fixtures/test-splat.3-points-from-train.";
    const auto ply = need(load_real(stem + "ply"));
    const auto spz = need(load_real(stem + "spz"));
    const auto& expected = ply.gaussians;
    const auto& got = spz.gaussians;
    ASSERT_EQ(got.count(), 3U);
    EXPECT_EQ(got.sh_degree, 3U);
    EXPECT_LE(test::max_difference(got.log_scales, expected.log_scales), 1.0 / 32 + 1e-6);
    EXPECT_LE(test::max_difference(got.means, expected.means), 0.5 / 4096 + 1e-6);
    EXPECT_LT(test::max_angle(got.rotations, expected.rotations), 0.005);
    for (std::size_t i = 0; i < got.sh.size(); ++i)
        EXPECT_NEAR(got.sh[i], expected.sh[i], i % 48 < 3 ? 0.0131 : 0.0665) << i;
}

TEST(RealScenes, CompressedGuitarIsTheDecodedOne) {
    SPLAT_NEEDS_REAL_DATA();
    const auto compressed = need(load_real("scenes/guitar.compressed.ply"));
    const auto plain = need(load_real("derived/guitar_inria_sh0.ply"));
    const auto& got = compressed.gaussians;
    const auto& expected = plain.gaussians;
    EXPECT_EQ(compressed.report.format, "compressed ply");
    EXPECT_EQ(got.count(), 90854U);
    EXPECT_EQ(got.sh_degree, 0U);
    EXPECT_LE(test::max_difference(got.means, expected.means), 1e-6);
    EXPECT_LE(test::max_difference(got.log_scales, expected.log_scales), 1e-5);
    EXPECT_LE(test::max_angle(got.rotations, expected.rotations), 2e-3);
    EXPECT_LE(test::max_difference(got.sh, expected.sh), 1e-5);
    double opacity = 0;
    for (std::size_t i = 0; i < got.count(); ++i)
        opacity = std::max(
            opacity, std::abs(scene::opacity_of(static_cast<double>(got.opacity_logits[i])) -
                              scene::opacity_of(static_cast<double>(expected.opacity_logits[i]))));
    EXPECT_LE(opacity, 1.01e-4) << "the other decoder stays 1e-4 away from 0 and 1";
    RecordProperty("non_finite", static_cast<int>(compressed.report.non_finite_values));
}

}  // namespace
}  // namespace splat::io
