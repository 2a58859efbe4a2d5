#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "scene/activate.h"
#include "scene/select.h"
#include "scene/sh.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::io {
namespace {

using namespace test;

bool accepts_compressed(Bytes file) {
    return read_compressed_ply(file).ok();
}

TEST(PlyCompressed, DecodesBothEndsOfEveryRange) {
    const auto g = need(read_compressed_ply(sample_compressed_ply({}))).gaussians;
    EXPECT_EQ(g.means, (std::vector<float>{-1, -1, -1, 2, 2, 2}));
    EXPECT_EQ(g.log_scales, (std::vector<float>{-8, -8, -8, 0, 0, 0}));
    EXPECT_NEAR(g.sh[0], -1 / scene::kSh0, 1e-5);
    EXPECT_NEAR(g.sh[5], 1 / scene::kSh0, 1e-5);
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.2 / 0.8), 1e-6);
    EXPECT_NEAR(g.rotations[0], 1, 1e-5);
    EXPECT_NEAR(g.rotations[4], std::sqrt(0.5), 1e-3) << "w first";
    EXPECT_NEAR(g.rotations[6], std::sqrt(0.5), 1e-3) << "the largest is y";
}

TEST(PlyCompressed, RangesOfColourMayBeAbsent) {
    const auto loaded = need(read_compressed_ply(sample_compressed_ply({.colors = false})));
    EXPECT_NEAR(loaded.gaussians.sh[0], -0.5 / scene::kSh0, 1e-5);
    EXPECT_NEAR(loaded.gaussians.sh[3], 0.5 / scene::kSh0, 1e-5);
}

TEST(PlyCompressed, BandsAreChannelMajorBytes) {
    for (const std::size_t rest : {9U, 24U, 45U}) {
        const auto g = need(read_compressed_ply(sample_compressed_ply({.rest = rest}))).gaussians;
        ASSERT_EQ(scene::sh_coefficients(g.sh_degree) * 3, rest + 3);
        EXPECT_EQ(g.sh[1 * 3 + 0], -4.0F) << "f_rest_0: coefficient 1, red";
        EXPECT_EQ(g.sh[2 * 3 + 0], 4.0F);
        EXPECT_EQ(g.sh[1 * 3 + 1], static_cast<float>(8 * (63.5 / 256 - 0.5)));
    }
}

TEST(PlyCompressed, ReportsPropertiesThatItDoesNotRead) {
    const auto loaded = need(read_compressed_ply(sample_compressed_ply({.extra = true})));
    EXPECT_EQ(loaded.report.ignored, (std::vector<std::string>{"chunk.extra", "vertex.extra"}));
    EXPECT_EQ(loaded.gaussians.means, (std::vector<float>{-1, -1, -1, 2, 2, 2}));
    EXPECT_TRUE(need(read_compressed_ply(sample_compressed_ply({}))).report.ignored.empty());
}

TEST(PlyCompressed, RefusesWhatDoesNotFitTogether) {
    const auto refused = [](CompressedPlyLayout layout, const char* part) {
        EXPECT_ERROR(read_compressed_ply(sample_compressed_ply(layout)), Code::kFormat, part);
    };
    CompressedPlyLayout layout{.chunks = "0"};
    EXPECT_FALSE(read_compressed_ply(sample_compressed_ply(layout)).ok());
    layout = {};
    layout.chunks = "1000000000000";
    refused(layout, "'chunk' at byte 0 needs");
    layout = {};
    layout.vertices = "99999999";
    refused(layout, "'vertex'");
    layout = {};
    layout.rest = 9;
    layout.rest_rows = "1";
    refused(layout, "one for each of 2");
    layout.rest = 10;
    refused(layout, "10 properties");
    EXPECT_ERROR(read_ply(sample_compressed_ply({})), Code::kFormat, "'opacity'");
    Buffer many = bytes_of(compressed_ply_header({true, 0, "1", "257", ""}));
    many.resize(many.size() + 18 * 4 + 257 * 16);
    EXPECT_ERROR(read_compressed_ply(many), Code::kFormat,
                 "1 chunks for 257 Gaussians, expected 2");
}

TEST(PlyCompressed, RefusesEveryPrefixAndSurvivesDamage) {
    CompressedPlyLayout layout{.rest = 9};
    expect_sturdy(sample_compressed_ply(layout), accepts_compressed);
}

/// Bounds of write_compressed_ply's docstring; ranges are those of a whole sample.
TEST(PlyCompressed, RoundTripIsWithinTheQuantisation) {
    for (std::uint32_t degree = 0; degree <= 3; ++degree) {
        const auto scene = sample_scene(700, degree, 3 + degree);
        const auto loaded = need(read_compressed_ply(need(write_compressed_ply(scene))));
        EXPECT_TRUE(loaded.report.ignored.empty());
        EXPECT_EQ(loaded.report.non_finite_values + loaded.report.bad_rotations, 0U);
        const auto& got = loaded.gaussians;
        const auto expected = need(scene::sort_morton(scene));
        ASSERT_EQ(got.sh_degree, degree);
        for (std::size_t i = 0; i < got.means.size(); ++i) {
            const double steps = i % 3 == 1 ? 1023 : 2047;
            ASSERT_NEAR(got.means[i], expected.means[i], 8 / steps / 2 + 1e-6) << i;
            ASSERT_NEAR(got.log_scales[i], expected.log_scales[i], 7 / steps / 2 + 1e-6) << i;
        }
        EXPECT_LT(max_angle(got.rotations, expected.rotations), 0.005);
        const std::size_t each = std::size_t{scene::sh_coefficients(degree)} * 3;
        for (std::size_t i = 0; i < got.count(); ++i)
            ASSERT_NEAR(scene::opacity_of(static_cast<double>(got.opacity_logits[i])),
                        scene::opacity_of(static_cast<double>(expected.opacity_logits[i])),
                        0.5 / 255 + 1e-6);
        for (std::size_t i = 0; i < got.sh.size(); ++i)
            ASSERT_NEAR(got.sh[i], expected.sh[i], (i % each < 3 ? 2.0 / 255 / 2 : 1.0 / 64) + 1e-6)
                << i;
    }
}

TEST(PlyCompressed, ChunksHoldTheirOwnRanges) {
    // 257 Gaussians, the last along the curve far away: it has a chunk of its own, and both are as exact as alone.
    auto scene = sample_scene(257, 0);
    for (float& value : scene.means) value *= 0.01F;
    for (std::size_t k = 0; k < 3; ++k) {
        scene.means[k] = 1000;
        scene.log_scales[k] = -30 - static_cast<float>(k);
        scene.sh[k] = 100;
    }
    const auto g = need(read_compressed_ply(need(write_compressed_ply(scene)))).gaussians;
    const auto expected = need(scene::sort_morton(scene));
    EXPECT_LE(max_difference(g.means, expected.means), 0.08 / 1023 / 2 + 1e-7);
    EXPECT_LE(max_difference(g.log_scales, expected.log_scales), 7.0 / 1023 / 2 + 1e-6);
    EXPECT_NEAR(g.sh[3 * 256], 100, 1e-4);
    EXPECT_EQ(g.log_scales[3 * 256], -30.0F) << "no scale is clamped";
}

TEST(PlyCompressed, ValuesThatAreAllAlikeStay) {
    auto scene = sample_scene(3, 0);
    std::ranges::fill(scene.means, 0.3F);
    std::ranges::fill(scene.log_scales, -2.7F);
    const auto g = need(read_compressed_ply(need(write_compressed_ply(scene)))).gaussians;
    EXPECT_EQ(g.means, scene.means);
    EXPECT_EQ(g.log_scales, scene.log_scales);
}

TEST(PlyCompressed, WritesTheLayoutOfSplatTransform) {
    auto scene = sample_scene(1, 1);
    scene.rotations = {-0.1F, 0.2F, -0.9F, 0.3F};
    scene.sh[1 * 3 + 0] = 4.0F;   // f_rest_0
    scene.sh[1 * 3 + 1] = -4.0F;  // f_rest_3
    const auto file = need(write_compressed_ply(scene));
    const CompressedPlyLayout layout{.rest = 9, .vertices = "1", .rest_rows = "1"};
    const std::string header = compressed_ply_header(layout);
    EXPECT_EQ(as_text(file).substr(0, header.size()), header);
    ASSERT_EQ(file.size(), header.size() + 18 * 4 + 4 * 4 + 9);
    const std::byte* const words = file.data() + header.size() + 18 * 4;
    EXPECT_EQ(number<std::uint32_t>(words), 0U) << "a range without width";
    EXPECT_EQ(number<std::uint32_t>(words + 4) >> 30U, 2U) << "y is the largest";
    const double others[] = {0.1, -0.2, -0.3};  // the sign of y turns all
    for (unsigned k = 0; k < 3; ++k)
        EXPECT_NEAR(((number<std::uint32_t>(words + 4) >> (20 - 10 * k)) & 1023U) / 1023.0,
                    0.5 + others[k] / std::sqrt(0.95) / std::sqrt(2.0), 0.51 / 1023);
    EXPECT_EQ(words[16], std::byte{255});
    EXPECT_EQ(words[16 + 3], std::byte{0});
}

TEST(PlyCompressed, TellsAndRefusesWhatItDoesNotHold) {
    auto scene = sample_scene(3, 1);
    scene.means[4] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(write_compressed_ply(scene), Code::kInvalidArgument,
                 "compressed ply: Gaussian 1 has a value that is not finite");
    scene = sample_scene(3, 1);
    scene.sh[2 * 12 + 5] = 4.5F;
    for (std::size_t k = 0; k < 4; ++k) scene.rotations[k] = 0;
    const LogCapture log;
    EXPECT_OK(write_compressed_ply(scene));
    EXPECT_EQ(log.text(),
              "compressed ply: 1 of 3 rotations have length 0\n"
              "compressed ply: 1 of 27 harmonics are beyond 4, and are clamped\n");
    for (const std::uint32_t degree : {0U, 2U}) {
        const auto none =
            need(read_compressed_ply(need(write_compressed_ply(sample_scene(0, degree)))));
        EXPECT_EQ(none.gaussians.count(), 0U);
    }
}

TEST(PlyCompressed, SaysThatAScenesOpacitiesAreAntialiased) {
    auto scene = sample_scene(3, 1);
    EXPECT_FALSE(
        need(read_compressed_ply(need(write_compressed_ply(scene)))).report.drawn_as.antialiased);
    scene.drawn_as.antialiased = true;
    EXPECT_TRUE(
        need(read_compressed_ply(need(write_compressed_ply(scene)))).report.drawn_as.antialiased);
}

}  // namespace
}  // namespace splat::io
