#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <cmath>

#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "scene/sh.h"
#include "support/expect_status.h"

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

}  // namespace
}  // namespace splat::io
