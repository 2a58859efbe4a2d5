#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "io/compress.h"
#include "io/sample_scene.h"
#include "scene/activate.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::io {
namespace {

using test::sample_scene;

SaveOptions version(std::uint32_t number) {
    SaveOptions options;
    options.spz_version = number;
    return options;
}

bool accepts_spz(Bytes file) {
    LoadOptions small;
    small.max_count = 1000;
    return read_spz(file, small).ok();
}

/// Header and arrays of a small file, before compression.
Buffer plain(std::uint32_t number, std::uint32_t count, std::uint8_t degree, std::uint8_t bits,
             std::initializer_list<int> arrays) {
    Buffer file;
    put_text(file, "NGSP");
    put(file, number);
    put(file, count);
    for (const int byte : {int{degree}, int{bits}, 0, 0})
        put(file, static_cast<std::uint8_t>(byte));
    for (const int byte : arrays) put(file, static_cast<std::uint8_t>(byte));
    return file;
}

/// Bounds of write_spz's docstring, with room for float32 rounding.
void expect_within_steps(const scene::Gaussians& got, const scene::Gaussians& expected,
                         double unit) {
    ASSERT_EQ(got.sh_degree, expected.sh_degree);
    EXPECT_LE(test::max_difference(got.means, expected.means), unit / 2 + 1e-6);
    EXPECT_LE(test::max_difference(got.log_scales, expected.log_scales), 1.0 / 32 + 1e-6);
    EXPECT_LT(test::max_angle(got.rotations, expected.rotations), 0.005);
    for (std::size_t i = 0; i < got.count(); ++i)
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(got.opacity_logits[i])),
                    scene::opacity_of(static_cast<double>(expected.opacity_logits[i])),
                    0.5 / 255 + 1e-6);
    const std::size_t each = std::size_t{scene::sh_coefficients(got.sh_degree)} * 3;
    for (std::size_t i = 0; i < got.sh.size(); ++i) {
        const std::size_t k = i % each;
        const double bound = k < 3 ? 0.5 / 255 / 0.15 : (k < 12 ? 4.0 / 128 : 8.0 / 128);
        ASSERT_NEAR(got.sh[i], expected.sh[i], bound + 1e-6) << "coefficient " << k;
    }
}

TEST(Spz, RoundTripIsWithinTheQuantisation) {
    for (const std::uint32_t number : {3U, 4U})
        for (std::uint32_t degree = 0; degree <= 3; ++degree) {
            const auto scene = sample_scene(500, degree, 7 + degree);
            const auto loaded = need(read_spz(need(write_spz(scene, version(number)))));
            EXPECT_EQ(loaded.report.version, number);
            EXPECT_EQ(loaded.report.frame, scene::Frame::kRub);
            EXPECT_EQ(loaded.report.non_finite_values, 0U);
            EXPECT_TRUE(loaded.report.ignored.empty());
            expect_within_steps(loaded.gaussians, scene, 1.0 / 4096);
        }
}

TEST(Spz, ASecondRoundTripChangesNothing) {
    const auto first = need(write_spz(sample_scene(50, 3)));
    EXPECT_EQ(first, need(write_spz(need(read_spz(first)).gaussians)));
}

/// A car of millimetres: positions keep their digits, and scales that a byte does not hold are told.
TEST(Spz, SmallScenesTakeAFinerUnit) {
    auto scene = sample_scene(300, 0);
    for (float& value : scene.means) value *= 1e-3F;
    SaveOptions options;
    options.clamp = true;
    for (float& value : scene.log_scales) value = -5;
    const auto back = need(read_spz(need(write_spz(scene, options))));
    float largest = 0;
    for (const float value : scene.means) largest = std::max(largest, std::abs(value));
    EXPECT_LT(test::max_difference(back.gaussians.means, scene.means),
              static_cast<double>(largest) / 65536);
}

TEST(Spz, RefusesAndTellsScalesThatItDoesNotHold) {
    auto scene = sample_scene(1000, 0);
    for (std::size_t i = 0; i < scene.log_scales.size(); ++i)
        scene.log_scales[i] = i < 3 * 500 ? -12 : -5;
    EXPECT_ERROR(write_spz(scene, {}), Code::kInvalidArgument,
                 "500 of 1000 Gaussians have a scale that the format does not hold, exp(-10) to "
                 "exp(5.9375); scale the scene by 7.8, write .ply, or let the scales be clamped");
    const auto warned = [](const scene::Gaussians& gaussians, const SaveOptions& options = {}) {
        const test::LogCapture log;
        EXPECT_OK(write_spz(gaussians, options));
        return log.text();
    };
    EXPECT_EQ(scales_beyond_spz(scene), 500U);
    SaveOptions clamp;
    clamp.clamp = true;
    EXPECT_HAS(warned(scene, clamp), "spz: 500 of 1000 Gaussians have a scale below exp(-10)");
    auto few = sample_scene(1000, 0);
    EXPECT_EQ(warned(few), "");
    for (std::size_t i = 0; i < 30; ++i) few.log_scales[i] = -12;  // ten: one in a hundred
    few.sh[5] = 9;
    for (std::size_t k = 0; k < 4; ++k) few.rotations[4 + k] = 0;
    EXPECT_EQ(warned(few),
              "spz: 10 of 1000 Gaussians have a scale below exp(-10), and get that\n"
              "spz: 1 of 3000 colours are outside what a byte holds, and are clipped\n"
              "spz: 1 of 1000 rotations have length 0\n");
    few.log_scales[30] = -12;
    EXPECT_FALSE(write_spz(few, {}).ok()) << "eleven";
    for (std::size_t i = 0; i < 60; ++i) few.log_scales[i] = 7;
    EXPECT_ERROR(write_spz(few, {}), Code::kInvalidArgument, "scale the scene by 0.33");
    for (std::size_t i = 60; i < 120; ++i) few.log_scales[i] = -12;
    EXPECT_ERROR(write_spz(few, {}), Code::kInvalidArgument, "exp(5.9375); write .ply, or let");
}

TEST(Spz, FarMeansTakeACoarserUnit) {
    auto scene = sample_scene(10, 0);
    scene.means[4] = 5000.0F;
    const auto loaded = need(read_spz(need(write_spz(scene))));
    expect_within_steps(loaded.gaussians, scene, 1.0 / 1024);
    scene.means[4] = 1e8F;
    EXPECT_ERROR(write_spz(scene), Code::kInvalidArgument, "1e+08 units");
}

TEST(Spz, ReadsVersion1And2) {
    // -1.5, 2, -0.25 as halves; opacity, colour, scale; x y z of the rotation
    const Buffer v1 =
        plain(1, 1, 0, 12,
              {0x00, 0xBE, 0x00, 0x40, 0x00, 0xB4, 51, 255, 0, 128, 160, 0, 255, 255, 127, 127});
    LoadOptions as_rdf;
    as_rdf.frame = scene::Frame::kRdf;
    auto loaded = read_spz(v1, as_rdf);
    ASSERT_OK(loaded);
    EXPECT_EQ(loaded.value().gaussians.means, (std::vector<float>{-1.5F, 2.0F, -0.25F}));
    EXPECT_EQ(loaded.value().gaussians.log_scales, (std::vector<float>{0.0F, -10.0F, 5.9375F}));
    EXPECT_NEAR(loaded.value().gaussians.rotations[1], 1.0, 1e-4);
    // the same with 24-bit fixed point of 4 fraction bits: -24/16, 2, -1/16
    const Buffer v2 = plain(2, 1, 0, 4,
                            {0xE8, 0xFF, 0xFF, 0x20, 0, 0, 0xFF, 0xFF, 0xFF, 51, 255, 0, 128, 160,
                             0, 255, 127, 127, 127});
    const auto packed = need(gzip(v2));
    EXPECT_EQ(packed[9], std::byte{3}) << "the system, by RFC 1952: the same on all";
    loaded = read_spz(packed);
    ASSERT_OK(loaded);
    EXPECT_EQ(loaded.value().gaussians.means, (std::vector<float>{-1.5F, -2.0F, 0.0625F}))
        << "RUB turned into RDF";
    EXPECT_NEAR(loaded.value().gaussians.rotations[0], 1.0, 1e-4);
}

TEST(Spz, DropsAndReportsDegree4) {
    Buffer file = plain(3, 1, 4, 12, {});
    file.resize(file.size() + 9 + 1 + 3 + 3 + 4 + 72, std::byte{128});
    const auto loaded = need(read_spz(file));
    EXPECT_EQ(loaded.gaussians.sh_degree, 3U);
    EXPECT_EQ(loaded.report.ignored, std::vector<std::string>{"SH band 4 (read to degree 3)"});
}

TEST(Spz, SaysThatAScenesOpacitiesAreAntialiased) {
    for (const std::uint32_t number : {3U, 4U})
        for (const bool antialiased : {false, true}) {
            auto scene = sample_scene(2, 1);
            scene.drawn_as.antialiased = antialiased;
            const auto loaded = need(read_spz(need(write_spz(scene, version(number)))));
            EXPECT_EQ(loaded.gaussians.drawn_as, scene.drawn_as);
            EXPECT_EQ(loaded.report.drawn_as, scene.drawn_as);
            EXPECT_TRUE(loaded.report.ignored.empty());
        }
}

TEST(Spz, RefusesHostileHeaders) {
    LoadOptions all;
    all.max_count = ~0ULL;
    const auto refused = [&all](const Buffer& file, Code code, const char* part) {
        EXPECT_ERROR(read_spz(file, all), code, part);
        EXPECT_ERROR(read_spz(need(gzip(file)), all), code, part);
    };
    refused(plain(5, 0, 0, 12, {}), Code::kUnsupported, "version 5");
    refused(plain(0, 0, 0, 12, {}), Code::kUnsupported, "version 0");
    refused(plain(3, 0, 5, 12, {}), Code::kFormat, "degree 5");
    refused(plain(3, 0, 0, 99, {}), Code::kFormat, "99 fraction bits");
    EXPECT_ERROR(read_spz(plain(3, 1000, 3, 12, {}), all), Code::kFormat, "truncated");
    const auto bomb = need(gzip(plain(3, 0xFFFFFFFF, 3, 12, {})));
    EXPECT_ERROR(read_spz(bomb, all), Code::kFormat, "too many for a file of");
    EXPECT_ERROR(read_spz(plain(3, 0xFFFFFFFF, 3, 12, {})), Code::kUnsupported, "max_count");
    EXPECT_ERROR(read_spz(plain(3, 0, 0, 12, {1})), Code::kFormat, "1 bytes after the last");
    Buffer extended = plain(3, 0, 0, 12, {});
    extended[14] = std::byte{2};
    EXPECT_ERROR(read_spz(extended), Code::kUnsupported, "extensions");
}

TEST(Spz, ALenientReaderLeavesOutWhatTheHeaderDoesNotCount) {
    LoadOptions lenient;
    lenient.lenient = true;
    const auto left_out = [&](Buffer file, const std::string& found) {
        EXPECT_ERROR(read_spz(file), Code::kFormat, "spz: " + found + ", expected none");
        const auto loaded = need(read_spz(file, lenient));
        EXPECT_EQ(loaded.report.left_out, found);
        EXPECT_EQ(loaded.gaussians.count(), 1U);
    };
    const auto longer = [](const Buffer& file, Bytes tail) {
        Buffer made = file;
        put_bytes(made, tail);
        return made;
    };
    for (const std::uint32_t number : {1U, 2U, 3U}) {
        Buffer whole = plain(number, 1, 0, 12, {});
        whole.resize(whole.size() + (number == 1 ? 16 : number == 2 ? 19 : 20), std::byte{60});
        const auto packed = need(gzip(whole));
        const auto more = need(gzip(longer(whole, Buffer(3))));
        EXPECT_EQ(read_spz(whole, lenient).value().report.left_out, "");
        EXPECT_EQ(read_spz(packed, lenient).value().report.left_out, "");
        left_out(longer(whole, Buffer(3)), "3 bytes after the last array");
        left_out(longer(packed, Buffer(4)), "4 bytes after the gzip data");
        left_out(longer(packed, packed), format("%zu bytes after the gzip data", packed.size()));
        left_out(more, "bytes in the gzip data after the last array");
        Buffer broken = packed;
        broken[broken.size() - 6] ^= std::byte{1};  // a byte of the checksum
        EXPECT_ERROR(read_spz(broken, lenient), Code::kFormat, "checksum is wrong");
    }
    const auto streams = need(write_spz(sample_scene(1, 1), version(4)));
    EXPECT_EQ(read_spz(streams, lenient).value().report.left_out, "");
    left_out(longer(streams, Buffer(5)), "5 bytes after the last stream");
}

TEST(Spz, RefusesEveryPrefixAndSurvivesDamage) {
    for (const std::uint32_t number : {3U, 4U}) {
        const auto file = need(write_spz(sample_scene(2, 1), version(number)));
        test::expect_sturdy(file, accepts_spz);
    }
    Buffer raw = plain(3, 1, 0, 12, {});
    raw.resize(raw.size() + 20);
    test::expect_sturdy(raw, accepts_spz);
}

TEST(Spz, EmptyScenes) {
    for (const std::uint32_t number : {3U, 4U}) {
        const auto loaded = need(read_spz(need(write_spz(sample_scene(0, 2), version(number)))));
        EXPECT_EQ(loaded.gaussians.count(), 0U);
    }
}

TEST(Spz, RefusesToWriteWhatItCannotHold) {
    auto scene = sample_scene(3, 1);
    EXPECT_ERROR(write_spz(scene, version(2)), Code::kUnsupported, "version 2");
    scene.sh[2 * 12 + 5] = std::numeric_limits<float>::infinity();
    EXPECT_ERROR(write_spz(scene), Code::kInvalidArgument, "Gaussian 2");
}

}  // namespace
}  // namespace splat::io
