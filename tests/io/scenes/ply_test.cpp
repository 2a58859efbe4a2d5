#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <tuple>

#include "io/sample_scene.h"
#include "support/compare.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::io {
namespace {

using namespace test;

const char* const kNames[] = {"x",      "y",       "z",       "f_dc_0",  "f_dc_1",
                              "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2",
                              "rot_0",  "rot_1",   "rot_2",   "rot_3"};

std::string header(const std::string& encoding, const std::string& rows,
                   const std::string& type = "float") {
    std::string text = "ply\nformat " + encoding + " 1.0\nelement vertex " + rows + "\n";
    for (const char* name : kNames) text += "property " + type + " " + name + "\n";
    return text;
}

const std::string kEnd = "end_header\n";
const std::string kRow = "1 2 3 0.5 -0.5 0 -1 -3 -4 -5 1 0 0 0\n";

Status status_of(const Buffer& file) {
    return read_ply(file).status();
}

bool accepts_ply(Bytes file) {
    return read_ply(file).ok();
}

TEST(Ply, RoundTripKeepsBits) {
    for (std::uint32_t degree = 0; degree <= 3; ++degree) {
        const auto scene = sample_scene(17, degree);
        const auto loaded = need(read_ply(need(write_ply(scene))));
        expect_same_bits(loaded.gaussians, scene);
        const LoadReport& report = loaded.report;
        EXPECT_EQ(report.count, 17U);
        EXPECT_EQ(report.sh_degree, degree);
        EXPECT_EQ(report.frame, scene::Frame::kRdf);
        EXPECT_TRUE(report.ignored.empty());
        EXPECT_EQ(report.non_finite_values + report.bad_rotations, 0U);
    }
}

TEST(Ply, WritesTheOrderThatViewersExpect) {
    const auto file = need(write_ply(sample_scene(1, 1)));
    const std::string text(as_text(file));
    std::string expected = "ply\nformat binary_little_endian 1.0\nelement vertex 1\n";
    for (const char* name :
         {"x",        "y",        "z",        "nx",       "ny",       "nz",       "f_dc_0",
          "f_dc_1",   "f_dc_2",   "f_rest_0", "f_rest_1", "f_rest_2", "f_rest_3", "f_rest_4",
          "f_rest_5", "f_rest_6", "f_rest_7", "f_rest_8", "opacity",  "scale_0",  "scale_1",
          "scale_2",  "rot_0",    "rot_1",    "rot_2",    "rot_3"})
        expected += std::string("property float ") + name + "\n";
    expected += "end_header\n";
    EXPECT_EQ(text.substr(0, expected.size()), expected);
    EXPECT_EQ(text.size(), expected.size() + 26 * 4);
}

TEST(Ply, RestCoefficientsAreChannelMajor) {
    auto scene = sample_scene(1, 1);
    const auto file = need(write_ply(scene));
    const std::byte* const rest = file.data() + file.size() - 4 * (8 + 9);
    for (std::size_t channel = 0; channel < 3; ++channel)
        for (std::size_t k = 0; k < 3; ++k)
            EXPECT_EQ(number<float>(rest + 4 * (channel * 3 + k)), scene.sh[(k + 1) * 3 + channel]);
}

TEST(Ply, ReadsAsciiWithEveryKindOfBlank) {
    const auto loaded =
        need(read_ply(bytes_of(header("ascii", "2") + "comment a b\r\n" + kEnd + kRow +
                               "\r\n\t+1 2e0 nan inf -inf 0 -1 -3 -4 -5 0 0 0 2")));
    const auto& g = loaded.gaussians;
    EXPECT_EQ(g.means[0], 1.0F);
    EXPECT_EQ(g.log_scales[2], -5.0F);
    EXPECT_EQ(g.means[4], 2.0F);
    EXPECT_TRUE(std::isnan(g.means[5]));
    EXPECT_EQ(g.rotations[7], 1.0F) << "normalised";
    EXPECT_EQ(loaded.report.non_finite_values, 3U);
}

TEST(Ply, ReadsBigEndianAndEveryScalarType) {
    const char* const types[] = {"char", "uchar", "short", "ushort",
                                 "int",  "uint",  "float", "double"};
    for (const auto& [encoding, order] : {std::pair{"binary_little_endian", std::endian::little},
                                          std::pair{"binary_big_endian", std::endian::big}})
        for (const char* type : types) {
            Buffer file = bytes_of(header(encoding, "1", type) + kEnd);
            for (int i = 0; i < 14; ++i) {
                const int value = i == 10 ? 1 : (i > 10 ? 0 : i + 3);
                const std::string_view name = type;
                if (name == "char") put(file, static_cast<std::int8_t>(value), order);
                if (name == "uchar") put(file, static_cast<std::uint8_t>(value), order);
                if (name == "short") put(file, static_cast<std::int16_t>(value), order);
                if (name == "ushort") put(file, static_cast<std::uint16_t>(value), order);
                if (name == "int") put(file, static_cast<std::int32_t>(value), order);
                if (name == "uint") put(file, static_cast<std::uint32_t>(value), order);
                if (name == "float") put(file, static_cast<float>(value), order);
                if (name == "double") put(file, static_cast<double>(value), order);
            }
            const auto loaded = read_ply(file);
            ASSERT_OK(loaded) << encoding << " " << type;
            EXPECT_EQ(loaded.value().gaussians.means, (std::vector<float>{3, 4, 5})) << type;
            EXPECT_EQ(loaded.value().gaussians.opacity_logits[0], 9.0F) << type;
            EXPECT_EQ(loaded.value().gaussians.rotations[0], 1.0F) << type;
        }
}

TEST(Ply, IgnoresAndReportsUnknownProperties) {
    std::string text =
        "ply\nformat ascii 1.0\nobj_info x\nelement camera 1\nproperty list uchar int id\n"
        "property float f\nelement nothing 99999999999999\nelement vertex 1\nproperty uchar red\n"
        "property list uchar float extra\n";
    for (int i = 13; i >= 0; --i) text += std::string("property float ") + kNames[i] + "\n";
    text += "element face 2\nproperty list uchar int vertex_indices\nend_header\n";
    text += "3 7 8 9 0.5\n200 2 0.1 0.2 0 0 0 1 3 4 5 6 0 0 0 13 12 11\n1 0 0\n";
    const auto loaded = need(read_ply(bytes_of(text)));
    EXPECT_EQ(loaded.gaussians.means, (std::vector<float>{11, 12, 13}));
    EXPECT_EQ(loaded.report.ignored,
              (std::vector<std::string>{"element camera", "element nothing", "vertex.red",
                                        "vertex.extra", "element face"}));
}

TEST(Ply, DropsAndReportsBandsAboveTheHighest) {
    std::string text = header("ascii", "1");
    std::string row = kRow.substr(0, kRow.size() - 1);
    for (int i = 0; i < 72; ++i) {
        text += "property float f_rest_" + std::to_string(i) + "\n";
        row += " " + std::to_string(i);
    }
    const auto loaded = need(read_ply(bytes_of(text + kEnd + row)));
    EXPECT_EQ(loaded.gaussians.sh_degree, 3U);
    EXPECT_EQ(loaded.gaussians.sh[15 * 3 + 1], 24.0F + 14.0F);
    EXPECT_EQ(loaded.report.ignored, std::vector<std::string>{"SH band 4 (read to degree 3)"});
}

/// A file with these lines in its header.
LoadedScene with_lines(const std::string& lines, const std::string& elements = "",
                       const std::string& rows = "") {
    return need(
        read_ply(bytes_of("ply\nformat ascii 1.0\n" + lines + header("ascii", "1").substr(21) +
                          elements + kEnd + kRow + rows)));
}

TEST(Ply, CommentsSayHowItIsDrawn) {
    const auto drawn = [](const std::string& lines) {
        const auto loaded = with_lines(lines);
        EXPECT_TRUE(loaded.report.ignored.empty()) << lines;
        EXPECT_EQ(loaded.report.drawn_as, loaded.gaussians.drawn_as);
        return loaded.report.drawn_as.antialiased;
    };
    EXPECT_FALSE(drawn("comment\ncomment made by x\ncomment antialiased or not\n"));
    EXPECT_FALSE(drawn("comment SplatRenderMode: default\n"));
    EXPECT_TRUE(drawn("comment SplatRenderMode: mip\n"));
    EXPECT_TRUE(drawn("comment  SplatRenderMode:  mip \r\n"));
    EXPECT_TRUE(drawn("comment antialiased 1\n"));
    EXPECT_FALSE(drawn("comment antialiased 0\n"));
    EXPECT_FALSE(drawn("comment antialiased 10\n"));
    EXPECT_FALSE(drawn("comment antialiased 1\ncomment SplatRenderMode: default\n")) << "the last";
}

TEST(Ply, ReportsModesThatItDoesNotDraw) {
    const LogCapture log;
    auto loaded = with_lines("comment SplatRenderMode: new\n");
    EXPECT_EQ(loaded.report.ignored, std::vector<std::string>{"SplatRenderMode: new"});
    EXPECT_EQ(log.text(), "");
    loaded = with_lines("comment SplatRenderMode: 2dgs\n");
    EXPECT_EQ(loaded.report.ignored, std::vector<std::string>{"SplatRenderMode: 2dgs"});
    EXPECT_HAS(log.text(), "Its Gaussians are flat, and drawn as 3D ones");
    std::string flat = header("ascii", "1") + kEnd + kRow;
    flat.erase(flat.find("property float scale_2\n"), 23);
    EXPECT_ERROR(status_of(bytes_of(flat)), Code::kFormat, "'scale_2'");
    EXPECT_ERROR(status_of(bytes_of(flat)), Code::kFormat, "Is it of 2D Gaussians?");
}

/// What SHARP writes behind the vertices; the colour space is 0 for sRGB and 1 for linear colours.
TEST(Ply, ElementsOfSharpAreUnderstoodOrListed) {
    const auto sharp = [](const std::string& color_space) {
        std::string elements, rows;
        for (const auto& [name, count, type] : {std::tuple{"extrinsic", 16, "float"},
                                                {"intrinsic", 9, "float"},
                                                {"image_size", 2, "uint"},
                                                {"frame", 2, "int"},
                                                {"disparity", 2, "float"}}) {
            elements += format("element %s %d\nproperty %s %s\n", name, count, type, name);
            for (int i = 0; i < count; ++i) rows += "1\n";
        }
        return with_lines("",
                          elements + "element color_space 1\nproperty uchar color_space\n" +
                              "element version 3\nproperty uchar version\n",
                          rows + color_space + "\n1\n5\n0\n");
    };
    const std::vector<std::string> others = {"element extrinsic",  "element intrinsic",
                                             "element image_size", "element frame",
                                             "element disparity",  "element version"};
    EXPECT_EQ(sharp("0").report.ignored, others);
    EXPECT_EQ(sharp("0").report.drawn_as, scene::DrawnAs());
    EXPECT_EQ(sharp("1").report.ignored, others);
    EXPECT_EQ(sharp("1").report.drawn_as, scene::DrawnAs{.linear_colors = true});
    auto more = others;
    more.insert(more.end() - 1, "element color_space of value 7");
    EXPECT_EQ(sharp("7").report.ignored, more);
    const auto other =
        with_lines("", "element color_space 2\nproperty uchar color_space\n", "1\n1\n");
    EXPECT_EQ(other.report.ignored, std::vector<std::string>{"element color_space"});
    EXPECT_EQ(other.report.drawn_as, scene::DrawnAs());
}

TEST(Ply, WritesHowItIsDrawn) {
    for (const scene::DrawnAs drawn :
         {scene::DrawnAs{.antialiased = true}, scene::DrawnAs{.linear_colors = true},
          scene::DrawnAs{.antialiased = true, .linear_colors = true}}) {
        auto scene = sample_scene(3, 1);
        scene.drawn_as = drawn;
        const auto file = need(write_ply(scene));
        const auto loaded = need(read_ply(file));
        expect_same_bits(loaded.gaussians, scene);
        EXPECT_EQ(loaded.gaussians.drawn_as, drawn);
        EXPECT_TRUE(loaded.report.ignored.empty());
        EXPECT_EQ(as_text(file).find("\ncomment SplatRenderMode: mip\n") != std::string::npos,
                  drawn.antialiased);
    }
}

TEST(Ply, KeepsAndCountsBadRotations) {
    const std::string row = "1 2 3 0.5 -0.5 0 -1 -3 -4 -5 ";
    const auto loaded = need(read_ply(bytes_of(header("ascii", "3") + kEnd + row + "0 0 0 0\n" +
                                               row + "nan 1 0 0\n" + row + "0 3 0 4\n")));
    EXPECT_EQ(loaded.report.bad_rotations, 2U);
    EXPECT_EQ(loaded.gaussians.rotations[1], 0.0F);
    EXPECT_EQ(loaded.gaussians.rotations[5], 1.0F);
    EXPECT_EQ(loaded.gaussians.rotations[9], 0.6F);
    EXPECT_EQ(loaded.gaussians.rotations[11], 0.8F);
}

TEST(Ply, KeepsNonFiniteValuesThroughARoundTrip) {
    auto scene = sample_scene(3, 1);
    scene.means[4] = std::numeric_limits<float>::quiet_NaN();
    scene.opacity_logits[2] = -std::numeric_limits<float>::infinity();
    scene.sh[7] = std::numeric_limits<float>::max();
    const auto loaded = need(read_ply(need(write_ply(scene))));
    expect_same_bits(loaded.gaussians, scene);
    EXPECT_EQ(loaded.report.non_finite_values, 2U);
}

TEST(Ply, RefusesHostileCountsBeforeItAllocates) {
    for (const char* encoding : {"ascii", "binary_little_endian", "binary_big_endian"})
        for (const char* count : {"2", "1000000000000", "18446744073709551615"})
            EXPECT_ERROR(status_of(bytes_of(header(encoding, count) + kEnd + kRow.substr(0, 28))),
                         Code::kFormat, "truncated")
                << encoding << " " << count;
    for (const char* count : {"-1", "x", "18446744073709551616", "1.5", ""})
        EXPECT_FALSE(status_of(bytes_of(header("ascii", count) + kEnd + kRow)).ok()) << count;
    LoadOptions small;
    small.max_count = 1;
    EXPECT_ERROR(read_ply(bytes_of(header("ascii", "2") + kEnd + kRow + kRow), small),
                 Code::kUnsupported, "max_count");
}

TEST(Ply, ErrorsNameProblemAndPlace) {
    const struct {
        std::string text;
        const char* part;
    } cases[] = {
        {"plx\n", "the first line is not 'ply'"},
        {"ply\nformat ascii 1.0\n", "without 'end_header'"},
        {"ply\nformat ascii 2.0\nend_header\n", "line 2"},
        {"ply\nformat binary 1.0\nend_header\n", "'binary', expected ascii"},
        {"ply\nelement vertex 1\nend_header\n", "no 'format'"},
        {"ply\nformat ascii 1.0\nend_header\n", "no element 'vertex'"},
        {"ply\nformat ascii 1.0\nproperty float x\n", "before the first element"},
        {header("ascii", "1") + "property float x\n", "a second property 'x'"},
        {header("ascii", "1", "half"), "line 4: type 'half'"},
        {header("ascii", "1") + "nonsense\n", "line 18: 'nonsense'"},
        {header("ascii", "1") + "property list float int a\n", "not an integer"},
        {"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n", "'opacity'"},
        {header("ascii", "1") + "property float f_rest_0\n" + kEnd, "1 properties f_rest_*"},
        {header("ascii", "1") + kEnd + "1 2 3 oops 0 0 0 0 0 0 0 0 0 0\n",
         "line 19: 'f_dc_0' is 'oops'"},
    };
    for (const auto& c : cases)
        EXPECT_ERROR(status_of(bytes_of(c.text)), Code::kFormat, c.part) << c.text;
}

/// A header that counts too few rows, or bytes at the end: refused, and left out and reported if lenient.
TEST(Ply, RefusesWhatTheHeaderDoesNotCount) {
    const auto file = write_ply(sample_scene(10, 0));
    ASSERT_OK(file);
    const std::string text(as_text(file.value()));
    const std::string few = std::string(text).replace(text.find("vertex 10"), 9, "vertex 1");
    const struct {
        std::string file;
        std::size_t count, bytes;
    } cases[] = {{few, 1, 9 * 68},
                 {text + "more", 10, 4},
                 {header("ascii", "1") + kEnd + kRow + kRow, 1, kRow.size() - 1 + 1}};
    for (const auto& c : cases) {
        const std::string said = std::to_string(c.bytes) + " bytes after the last row";
        EXPECT_ERROR(status_of(bytes_of(c.file)), Code::kFormat, said.c_str());
        LoadOptions lenient;
        lenient.lenient = true;
        const auto loaded = need(read_ply(bytes_of(c.file), lenient));
        EXPECT_EQ(loaded.gaussians.count(), c.count);
        EXPECT_TRUE(loaded.report.left_out.starts_with(said)) << loaded.report.left_out;
    }
    EXPECT_OK(status_of(bytes_of(header("ascii", "1") + kEnd + kRow + " \n\r\n"))) << "blanks";
}

TEST(Ply, RefusesEveryPrefix) {
    const auto file = need(write_ply(sample_scene(2, 1)));
    expect_prefixes_refused(file, accepts_ply);
    const std::string ascii = header("ascii", "1") + kEnd + kRow;
    expect_prefixes_refused(bytes_of(ascii.substr(0, ascii.size() - 2)), accepts_ply);
}

TEST(Ply, SurvivesDamage) {
    const auto file = need(write_ply(sample_scene(1, 1)));
    parse_damaged(file, accepts_ply);
    parse_damaged(bytes_of(header("ascii", "1") + kEnd + kRow), accepts_ply);
}

TEST(Ply, WritesAnotherDegreeOrFrame) {
    const auto scene = sample_scene(3, 2);
    SaveOptions options;
    options.sh_degree = 3;
    options.frame = scene::Frame::kRub;
    const auto file = need(write_ply(scene, options));
    LoadOptions as_rub;
    as_rub.frame = scene::Frame::kRub;
    auto loaded = need(read_ply(file, as_rub));
    EXPECT_EQ(loaded.gaussians.means, scene.means);
    EXPECT_EQ(loaded.gaussians.sh_degree, 3U);
    EXPECT_EQ(loaded.report.frame, scene::Frame::kRub);
    EXPECT_EQ(need(read_ply(file)).gaussians.means[1], -scene.means[1]);
    options.sh_degree = 4;
    EXPECT_ERROR(write_ply(scene, options), Code::kInvalidArgument, "sh_degree 4");
    auto broken = scene;
    broken.means.pop_back();
    EXPECT_ERROR(write_ply(broken), Code::kInvalidArgument, "'means'");
}

}  // namespace
}  // namespace splat::io
