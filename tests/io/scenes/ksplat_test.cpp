#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>

#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/scene_formats.h"
#include "scene/sh.h"
#include "support/expect_status.h"

namespace splat::io {
namespace {

using namespace test;

bool accepts_ksplat(Bytes file) {
    LoadOptions small;
    small.max_count = 1000;
    return read_ksplat(file, small).ok();
}

/// The sample with a value at this byte.
template <class T>
Buffer patched(std::size_t at, T value, std::uint16_t level = 1, std::uint16_t degree = 1) {
    Buffer file = sample_ksplat(level, {degree});
    std::memcpy(file.data() + at, &value, sizeof value);
    return file;
}

constexpr std::size_t kSection = 4096;           ///< header of the first section
constexpr std::size_t kData = kSection + 1024;   ///< counts of its two partial buckets
constexpr std::size_t kCenters = kData + 2 * 4;  ///< centres of the section's three buckets
constexpr std::size_t kRows = kCenters + 3 * 12;

TEST(Ksplat, EveryLevelAndDegreeDecodes) {
    for (std::uint16_t level = 0; level <= 2; ++level)
        for (std::uint16_t degree = 0; degree <= 2; ++degree) {
            SCOPED_TRACE(testing::Message() << "level " << level << ", degree " << degree);
            const auto loaded = need(read_ksplat(sample_ksplat(level, {degree})));
            const auto& g = loaded.gaussians;
            EXPECT_EQ(loaded.report.version, 1U);
            EXPECT_TRUE(loaded.report.ignored.empty());
            ASSERT_EQ(g.count(), 5U) << "the sixth row is room that no Gaussian takes";
            ASSERT_EQ(g.sh_degree, degree);
            EXPECT_EQ(g.means, (std::vector<float>{0, 0, 0, 0.125F, -0.125F, 0, 1.25F, -0.25F, 1,
                                                   2.375F, -0.375F, 2, 2.5F, -0.5F, 2}));
            const std::size_t each = 3 * scene::sh_coefficients(degree);
            for (std::size_t i = 0; i < 5; ++i) {
                EXPECT_NEAR(g.log_scales[3 * i], std::log(0.5), 1e-6);
                EXPECT_EQ(g.log_scales[3 * i + 1], 0.0F);
                EXPECT_NEAR(g.log_scales[3 * i + 2], std::log(2.0), 1e-6);
                EXPECT_EQ(g.rotations[4 * i], 0.5F) << "w first";
                EXPECT_EQ(g.rotations[4 * i + 1], -0.5F);
                EXPECT_NEAR(g.sh[each * i], 0.5 / scene::kSh0, 1e-5);
                EXPECT_NEAR(g.sh[each * i + 1], -0.5 / scene::kSh0, 1e-5);
                const double opacity = (51.0 + static_cast<double>(i)) / 255;
                EXPECT_NEAR(g.opacity_logits[i], std::log(opacity / (1 - opacity)), 1e-5);
            }
        }
}

TEST(Ksplat, BandsFollowEachOtherChannelByChannel) {
    // Coefficients 1 to 3 of red are 0, 1, 2 in the file, green ones 3 to 5; those of band 2 begin with 9, 14, 19.
    for (std::uint16_t level = 0; level <= 2; ++level) {
        const auto g = need(read_ksplat(sample_ksplat(level, {2}))).gaussians;
        const auto expect = [&](std::size_t coefficient, std::size_t channel, int place) {
            const double value = level == 2 ? -1 + 10 * place / 255.0 * 3 : (place - 4) / 8.0;
            EXPECT_NEAR(g.sh[coefficient * 3 + channel], value, 1e-6) << level << " " << place;
        };
        expect(1, 0, 0);
        expect(3, 0, 2);
        expect(1, 1, 3);
        expect(2, 2, 7);
        expect(4, 0, 9);
        expect(8, 0, 13);
        expect(4, 1, 14);
        expect(8, 2, 23);
    }
}

TEST(Ksplat, SectionsMayDifferInDegree) {
    for (std::uint16_t level = 0; level <= 2; ++level) {
        const auto g = need(read_ksplat(sample_ksplat(level, {1, 2, 0}))).gaussians;
        ASSERT_EQ(g.count(), 15U);
        ASSERT_EQ(g.sh_degree, 2U);
        EXPECT_EQ(g.means[3 * 14], 22.5F) << "the third section has its own buckets";
        EXPECT_NE(g.sh[27 * 5 + 3 * 8], 0.0F);
        for (std::size_t k = 12; k < 27; ++k) EXPECT_EQ(g.sh[k], 0.0F) << "the first lacks band 2";
        for (std::size_t k = 3; k < 27; ++k) EXPECT_EQ(g.sh[27 * 14 + k], 0.0F);
    }
}

TEST(Ksplat, ZerosInHeadersStandForTheUsualValues) {
    auto g = need(read_ksplat(patched(kSection + 24, 0U))).gaussians;
    const double place = (256 + 16 - 32767.0) * 2 / 32767;
    EXPECT_NEAR(g.means[3], place, 1e-6) << "steps of 1/32767 of half a block";
    Buffer file = patched(36, 0.0F, 2);
    std::memset(file.data() + 40, 0, 4);
    g = need(read_ksplat(file)).gaussians;
    EXPECT_EQ(g.sh[3], -1.5F);
    EXPECT_NEAR(g.sh[4], 30 / 255.0 * 3 - 1.5, 1e-6);
}

TEST(Ksplat, EmptyBucketsAreSkipped) {
    // Three partial buckets of 0, 3 and 2 instead of a full and two partial ones.
    Buffer file = sample_ksplat(1, {0});
    const auto set = [&file](std::size_t at, std::uint32_t value) {
        std::memcpy(file.data() + at, &value, sizeof value);
    };
    set(kSection + 32, 0);
    set(kSection + 36, 3);
    set(kData, 0);
    set(kData + 4, 3);
    const std::uint32_t last = 2;
    const auto* bytes = reinterpret_cast<const std::byte*>(&last);
    file.insert(file.begin() + kData + 8, bytes, bytes + 4);
    const auto g = need(read_ksplat(file)).gaussians;
    EXPECT_EQ(g.means[2], 1.0F) << "the second bucket";
    EXPECT_EQ(g.means[8], 1.0F);
    EXPECT_EQ(g.means[11], 2.0F);
}

TEST(Ksplat, CountsScalesThatHaveNoLogarithm) {
    const auto loaded = need(read_ksplat(patched(kRows + 6, std::uint16_t{0})));
    EXPECT_EQ(loaded.report.non_finite_values, 1U);
}

TEST(Ksplat, RefusesWhatContradictsItself) {
    const auto refused = [](const Buffer& file, const char* part, Code code = Code::kFormat) {
        EXPECT_ERROR(read_ksplat(file), code, part);
    };
    refused(patched(0, std::uint8_t{1}), "version 1.1, expected 0.1", Code::kUnsupported);
    refused(patched(1, std::uint8_t{0}), "version 0.0", Code::kUnsupported);
    refused(patched(20, std::uint16_t{3}), "compression level 3, expected 0 to 2");
    refused(patched(4, 0U), "5 Gaussians, but its 0 sections hold 0");
    refused(patched(4, ~0U), "'section headers' at byte 4096 needs");
    refused(patched(16, 6U), "6 Gaussians, but its 1 sections hold 5");
    refused(patched(16, ~0U), "4294967295 Gaussians, but");
    refused(patched(36, std::numeric_limits<float>::quiet_NaN(), 2), "harmonics from nan to 2");
    refused(patched(kSection, 7U), "section 0: 7 Gaussians in a section for 6");
    refused(patched(kSection + 4, ~0U), "'Gaussians' at byte 5164 needs");
    refused(patched(kSection + 8, 1U), "buckets for 4 Gaussians, expected 5");
    refused(patched(kSection + 12, 2U), "1 full and 2 other buckets, but 2 in all");
    refused(patched(kSection + 12, ~0U), "'centres of buckets' at byte 5128 needs");
    refused(patched(kSection + 16, 0.0F), "blocks of size 0, expected more than 0");
    refused(patched(kSection + 16, std::numeric_limits<float>::infinity()), "blocks of size inf");
    refused(patched(kSection + 20, std::uint16_t{16}), "buckets of 16 bytes, expected 12");
    refused(patched(kSection + 36, ~0U), "1 full and 4294967295 other buckets");
    refused(patched(kSection + 40, std::uint16_t{3}), "SH degree 3, expected 0 to 2");
    refused(patched(kData, 0U), "buckets for 4 Gaussians, expected 5");
    refused(patched(kSection + 36, ~0U, 0), "'counts of partial buckets' at byte 5120 needs");
    LoadOptions few;
    few.max_count = 4;
    EXPECT_ERROR(read_ksplat(sample_ksplat(0, {0}), few), Code::kUnsupported, "max_count");
}

TEST(Ksplat, ALenientReaderLeavesOutWhatTheHeadersDoNotCount) {
    Buffer file = sample_ksplat(1, {1});
    file.resize(file.size() + 3);
    EXPECT_ERROR(read_ksplat(file), Code::kFormat, "3 bytes after the last section");
    LoadOptions lenient;
    lenient.lenient = true;
    const auto loaded = need(read_ksplat(file, lenient));
    EXPECT_EQ(loaded.report.left_out, "3 bytes after the last section");
    EXPECT_EQ(loaded.gaussians.count(), 5U);
}

TEST(Ksplat, RefusesEveryPrefixAndSurvivesDamage) {
    for (std::uint16_t level = 0; level <= 2; ++level)
        expect_sturdy(sample_ksplat(level, {1}), accepts_ksplat);
}

}  // namespace
}  // namespace splat::io
