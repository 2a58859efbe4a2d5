#include "io/ply_compressed.h"

#include <gtest/gtest.h>

#include <cmath>

#include "io/ply.h"
#include "io/sample_scene.h"
#include "scene/sh.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

const char* const kRanges[] = {
    "min_x",       "min_y",       "min_z",       "max_x",       "max_y",       "max_z",
    "min_scale_x", "min_scale_y", "min_scale_z", "max_scale_x", "max_scale_y", "max_scale_z",
    "min_r",       "min_g",       "min_b",       "max_r",       "max_g",       "max_b"};

struct Layout {
    bool colors = true;
    std::size_t rest = 0;
    std::string chunks = "1";
    std::string vertices = "2";
    std::string rest_rows = "2";
};

std::string header(const Layout& layout) {
    std::string text =
        "ply\nformat binary_little_endian 1.0\nelement chunk " + layout.chunks + "\n";
    for (int i = 0; i < (layout.colors ? 18 : 12); ++i)
        text += std::string("property float ") + kRanges[i] + "\n";
    text += "element vertex " + layout.vertices + "\n";
    for (const char* name : {"position", "rotation", "scale", "color"})
        text += std::string("property uint packed_") + name + "\n";
    if (layout.rest > 0) text += "element sh " + layout.rest_rows + "\n";
    for (std::size_t i = 0; i < layout.rest; ++i)
        text += "property uchar f_rest_" + std::to_string(i) + "\n";
    return text + "end_header\n";
}

/// Two Gaussians: at the low end and at the high end of every range.
Buffer sample(const Layout& layout) {
    Buffer file = test::bytes_of(header(layout));
    for (int i = 0; i < (layout.colors ? 18 : 12); ++i) {
        const bool high = i % 6 >= 3;
        put(file, static_cast<float>(i < 6    ? (high ? 2 : -1)
                                     : i < 12 ? (high ? 0 : -8)
                                              : (high ? 1.5 : -0.5)));
    }
    const std::uint32_t middle = 0x1FF;  // of 10 bits: -0.0007
    for (const std::uint32_t word : {0U, middle << 20U | middle << 10U | middle, 0U, 51U})
        put(file, word);
    for (const std::uint32_t word :
         {~0U, 2U << 30U | 1023U << 20U | middle << 10U | middle, ~0U, ~0U - 255U + 51U})
        put(file, word);
    for (std::size_t i = 0; i < 2 * layout.rest; ++i)
        put(file, static_cast<std::uint8_t>(i % layout.rest == 0   ? 0
                                            : i % layout.rest == 1 ? 255
                                                                   : 63));
    return file;
}

bool accepts(Bytes file) {
    return read_compressed_ply(file).ok();
}

TEST(PlyCompressed, DecodesBothEndsOfEveryRange) {
    const auto loaded = read_compressed_ply(sample({}));
    ASSERT_OK(loaded.status());
    const auto& g = loaded.value().gaussians;
    EXPECT_EQ(g.means, (std::vector<float>{-1, -1, -1, 2, 2, 2}));
    EXPECT_EQ(g.log_scales, (std::vector<float>{-8, -8, -8, 0, 0, 0}));
    EXPECT_NEAR(g.sh[0], -1 / scene::kSh0, 1e-5);
    EXPECT_NEAR(g.sh[5], 1 / scene::kSh0, 1e-5);
    EXPECT_NEAR(g.opacity_logits[0], std::log(0.2 / 0.8), 1e-6);
    EXPECT_NEAR(g.rotations[0], 1, 1e-5);
    EXPECT_NEAR(g.rotations[4], std::sqrt(0.5), 1e-3) << "w first";
    EXPECT_NEAR(g.rotations[6], std::sqrt(0.5), 1e-3) << "the largest is y";
    EXPECT_EQ(loaded.value().report.format, "compressed ply");
}

TEST(PlyCompressed, RangesOfColourMayBeAbsent) {
    Layout layout;
    layout.colors = false;
    const auto loaded = read_compressed_ply(sample(layout));
    ASSERT_OK(loaded.status());
    EXPECT_NEAR(loaded.value().gaussians.sh[0], -0.5 / scene::kSh0, 1e-5);
    EXPECT_NEAR(loaded.value().gaussians.sh[3], 0.5 / scene::kSh0, 1e-5);
}

TEST(PlyCompressed, BandsAreChannelMajorBytes) {
    for (const std::size_t rest : {9U, 24U, 45U}) {
        Layout layout;
        layout.rest = rest;
        const auto loaded = read_compressed_ply(sample(layout));
        ASSERT_OK(loaded.status());
        const auto& g = loaded.value().gaussians;
        ASSERT_EQ(scene::sh_coefficients(g.sh_degree) * 3, rest + 3);
        EXPECT_EQ(g.sh[1 * 3 + 0], -4.0F) << "f_rest_0: coefficient 1, red";
        EXPECT_EQ(g.sh[2 * 3 + 0], 4.0F);
        EXPECT_EQ(g.sh[1 * 3 + 1], static_cast<float>(8 * (63.5 / 256 - 0.5)));
    }
}

TEST(PlyCompressed, RefusesWhatDoesNotFitTogether) {
    const auto refused = [](Layout layout, const char* part) {
        EXPECT_ERROR(read_compressed_ply(sample(layout)).status(), Code::kInvalidArgument, part);
    };
    Layout layout;
    layout.chunks = "0";
    EXPECT_FALSE(read_compressed_ply(sample(layout)).ok());
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
    EXPECT_ERROR(read_ply(sample({})).status(), Code::kInvalidArgument, "'opacity'");
    Buffer many = test::bytes_of(header({true, 0, "1", "257", ""}));
    many.resize(many.size() + 18 * 4 + 257 * 16);
    EXPECT_ERROR(read_compressed_ply(many).status(), Code::kInvalidArgument,
                 "1 chunks for 257 Gaussians, expected 2");
}

TEST(PlyCompressed, RefusesEveryPrefixAndSurvivesDamage) {
    Layout layout;
    layout.rest = 9;
    test::expect_prefixes_refused(sample(layout), accepts);
    test::parse_damaged(sample(layout), accepts);
}

}  // namespace
}  // namespace splat::io
