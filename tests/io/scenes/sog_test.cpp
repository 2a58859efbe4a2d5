#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/json_tree.h"
#include "io/file.h"
#include "io/photo/photo.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/scene_file.h"
#include "io/zip.h"
#include "scene/activate.h"
#include "scene/arrays.h"
#include "scene/select.h"
#include "support/expect_status.h"
#include "support/log_capture.h"
#include "support/real_data.h"

namespace splat::io {
namespace {

using scene::Gaussians;
using test::bytes_of;
using test::sample_scene;

class SogFolder : public test::FolderTest {};

/// Names and bytes of an archive's files.
using Parts = std::vector<std::pair<std::string, Buffer>>;

Parts unpack(Bytes file) {
    const MemorySource source(file);
    const auto zip = need(Zip::open(source, "test"));
    Parts parts;
    for (const ZipEntry& entry : zip.entries()) {
        parts.emplace_back(entry.name, Buffer());
        EXPECT_OK(zip.read(entry, parts.back().second));
    }
    return parts;
}

Buffer pack(const Parts& parts) {
    std::vector<ZipMember> members;
    for (const auto& [name, bytes] : parts) members.push_back({name, bytes, {}});
    return need(write_zip(std::move(members))).joined();
}

Buffer& part(Parts& parts, const std::string& name) {
    const auto found =
        std::ranges::find_if(parts, [&](const auto& each) { return each.first == name; });
    EXPECT_NE(found, parts.end()) << name;
    return found->second;
}

/// The file with a text of its meta.json replaced.
Buffer with_meta(const Buffer& file, const std::string& from, const std::string& to) {
    Parts parts = unpack(file);
    Buffer& meta = part(parts, "meta.json");
    std::string text(as_text(meta));
    const std::size_t place = text.find(from);
    EXPECT_NE(place, std::string::npos) << from;
    meta = bytes_of(text.replace(place, from.size(), to));
    return pack(parts);
}

Buffer with_image(const Buffer& file, const std::string& name, std::uint32_t width,
                  std::uint32_t height, std::uint8_t value) {
    Parts parts = unpack(file);
    const std::vector<std::uint8_t> rgba(std::size_t{4} * width * height, value);
    part(parts, name) = need(write_webp(rgba, width, height));
    return pack(parts);
}

/// The widest gap between two numbers of a codebook: a value is off by half of it at most.
double widest_gap(const Buffer& file, const char* section) {
    Parts parts = unpack(file);
    const auto meta = need(parse_json_tree(as_text(part(parts, "meta.json")), "meta"));
    double widest = 0;
    const auto& codes = meta[section]["codebook"].items();
    for (std::size_t i = 1; i < codes.size(); ++i)
        widest = std::max(widest, *codes[i].number() - *codes[i - 1].number());
    return widest;
}

void expect_within_steps(const Gaussians& got, const Gaussians& expected, const Buffer& file) {
    ASSERT_EQ(got.count(), expected.count());
    ASSERT_EQ(got.sh_degree, expected.sh_degree);
    double range = 0;
    for (const float value : expected.means)
        range = std::max(range, std::abs(static_cast<double>(value)));
    // The derivative of x to sign(x) ln(1 + |x|) is 1 / (1 + |x|).
    EXPECT_LE(test::max_difference(got.means, expected.means),
              std::log1p(range) / 65535 * (1 + range) + 1e-6);
    // Three components are off by half a step s. The fourth, w = sqrt(1 - |v|^2), is at least 1/2 and the others are at
    // most w. So it is off by (v.d) / w <= 3 s and, in the second order, by |d|^2 / 2w + (v.d)^2 / 2w^3 <= 12 s^2.
    const double s = std::sqrt(2) / 510;
    EXPECT_LE(test::max_angle(got.rotations, expected.rotations),
              2 * std::hypot(std::sqrt(3) * s, 3 * s + 12 * s * s) + 1e-6);
    EXPECT_LE(test::max_difference(got.log_scales, expected.log_scales),
              widest_gap(file, "scales") / 2 + 1e-6);
    for (std::size_t i = 0; i < got.count(); ++i)
        EXPECT_NEAR(scene::opacity_of(static_cast<double>(got.opacity_logits[i])),
                    scene::opacity_of(static_cast<double>(expected.opacity_logits[i])),
                    0.5 / 255 + 1e-6);
    const std::size_t each = std::size_t{scene::sh_coefficients(got.sh_degree)} * 3;
    const double color = widest_gap(file, "sh0") / 2 + 1e-6;
    const double rest = got.sh_degree > 0 ? widest_gap(file, "shN") / 2 + 1e-6 : 0;
    for (std::size_t i = 0; i < got.sh.size(); ++i)
        ASSERT_NEAR(got.sh[i], expected.sh[i], i % each < 3 ? color : rest) << "coefficient " << i;
}

TEST(Sog, RoundTripIsWithinTheQuantisation) {
    for (std::uint32_t degree = 0; degree <= 3; ++degree)
        for (const std::size_t count : {1U, 5U, 301U}) {
            const auto scene = need(scene::sort_morton(sample_scene(count, degree, 7 + degree)));
            const Buffer file = need(write_sog(scene));
            const auto loaded = need(read_sog(file));
            EXPECT_EQ(loaded.report.version, 2U);
            EXPECT_EQ(loaded.report.non_finite_values, 0U);
            EXPECT_TRUE(loaded.report.ignored.empty());
            expect_within_steps(loaded.gaussians, scene, file);
        }
}

TEST(Sog, EmptyScenesKeepTheirDegree) {
    for (const std::uint32_t degree : {0U, 2U}) {
        const auto loaded = need(read_sog(need(write_sog(sample_scene(0, degree)))));
        EXPECT_EQ(loaded.gaussians.count(), 0U);
        EXPECT_EQ(loaded.gaussians.sh_degree, degree);
    }
}

TEST(Sog, AntialiasedIsKept) {
    auto scene = sample_scene(3, 0);
    EXPECT_FALSE(need(read_sog(need(write_sog(scene)))).gaussians.drawn_as.antialiased);
    scene.drawn_as.antialiased = true;
    const auto loaded = need(read_sog(need(write_sog(scene))));
    EXPECT_TRUE(loaded.gaussians.drawn_as.antialiased);
    EXPECT_TRUE(loaded.report.drawn_as.antialiased);
}

TEST(Sog, ASecondRoundTripKeepsHarmonicsColorsAndScales) {
    const auto first = need(read_sog(need(write_sog(sample_scene(3000, 1))))).gaussians;
    const auto second = need(read_sog(need(write_sog(first)))).gaussians;
    const auto sorted = need(scene::sort_morton(first));
    EXPECT_EQ(second.sh, sorted.sh);
    EXPECT_EQ(second.log_scales, sorted.log_scales);
    EXPECT_EQ(second.opacity_logits, sorted.opacity_logits);
}

TEST(Sog, InfiniteOpacitiesAndEqualPlaces) {
    auto scene = sample_scene(4, 0);
    std::ranges::fill(scene.means, 2.5F);
    scene.opacity_logits = {-std::numeric_limits<float>::infinity(),
                            std::numeric_limits<float>::infinity(), 0, 90};
    const auto got = need(read_sog(need(write_sog(scene)))).gaussians;
    EXPECT_LE(test::max_difference(got.means, scene.means), 1e-6);
    EXPECT_NEAR(got.opacity_logits[0], -scene::kMaxOpacityLogit, 1e-4);
    EXPECT_NEAR(got.opacity_logits[1], scene::kMaxOpacityLogit, 1e-4);
}

TEST(Sog, EveryRunAndNumberOfThreadsGivesTheSameBits) {
    const auto scene = sample_scene(1300, 2);  // three leaves, 1024 entries
    SaveOptions options;
    options.threads = 1;
    const Buffer file = need(write_sog(scene, options));
    for (const std::size_t threads : {1U, 2U, 3U}) {
        options.threads = threads;
        EXPECT_EQ(need(write_sog(scene, options)), file) << threads;
    }
}

TEST(Sog, RefusesToWriteWhatItCannotHold) {
    auto scene = sample_scene(3, 1);
    scene.sh[12 + 5] = 2e6F;
    EXPECT_ERROR(write_sog(scene), Code::kInvalidArgument, "Gaussian 1 has a colour coefficient");
    scene.sh[12 + 5] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_ERROR(write_sog(scene), Code::kInvalidArgument, "Gaussian 1 has a value that is not");
    auto zero = sample_scene(3, 0);
    std::fill_n(zero.rotations.begin(), 4, 0.0F);
    const test::LogCapture log;
    EXPECT_OK(write_sog(zero));
    EXPECT_HAS(log.text(), "sog: 1 of 3 rotations have length 0");
}

TEST(Sog, RefusesDamagedMeta) {
    const Buffer file = need(write_sog(sample_scene(20, 1)));
    const auto refused = [&](const std::string& from, const std::string& to, const char* part,
                             Code code = Code::kFormat) {
        EXPECT_ERROR(read_sog(with_meta(file, from, to)), code, part);
    };
    refused("\"version\":2", "\"version\":3", "is not 2", Code::kUnsupported);
    refused("\"version\":2,", "", "'scales.mins' of meta.json has 0 numbers");
    refused("\"count\":20", "\"count\":-1", "'count' of meta.json is missing");
    refused("\"count\":20", "\"count\":65", "8 x 4 pixels, too few for the 65 Gaussians");
    refused("\"count\":20", "\"count\":1e12", "the limit is", Code::kUnsupported);
    refused("\"mins\":[", "\"mins\":[NaN,", "not valid JSON");
    refused("\"mins\":[", "\"mins\":[0,", "'means.mins' of meta.json has 4 numbers, expected 3");
    refused("\"mins\":[", "\"mins\":[1e999,", "meta.json");
    refused("\"maxs\":[", "\"maxs\":[null],\"no\":[", "'means.maxs' of meta.json has 1");
    refused("\"codebook\":[", "\"codebook\":[0,", "'scales.codebook' of meta.json has 257 numbers");
    refused("\"bands\":1", "\"bands\":4", "'shN.bands'");
    refused("\"bands\":1", "\"bands\":2", "is 192 pixels wide");
    refused("\"shN\":{\"count\":20", "\"shN\":{\"count\":65537", "'shN.count'");
    refused("\"shN\":{\"count\":20", "\"shN\":{\"count\":65", "holds 64 entries");
    refused("\"shN\":{\"count\":20", "\"shN\":{\"count\":3", "of the palette, which has 3");
    refused("quats.webp", "none.webp", "the archive has no 'none.webp'");
    refused("\"quats.webp\"", "7", "'quats.files'");
    refused("\"quats.webp\"", "\"a\",\"b\"", "the name of an image");
    refused("{\"version\"", "[{\"version\"", "not valid JSON");
    for (const char* name : {"../a.webp", "/etc/passwd", "..", "C:a", "https://a/b.webp",
                             "..\\\\a.webp", "\\\\\\\\host\\\\a.webp"})
        refused("quats.webp", name, "expected a file beside meta.json");
    const auto more = need(read_sog(with_meta(file, "\"asset\"", "\"new\":1,\"asset\"")));
    EXPECT_EQ(more.report.ignored, std::vector<std::string>{"member new"});
}

TEST(Sog, RefusesOtherImages) {
    const Buffer file = need(write_sog(sample_scene(20, 1)));
    EXPECT_ERROR(read_sog(with_image(file, "scales.webp", 4, 8, 0)), Code::kFormat,
                 "'scales.webp' has 4 x 8 pixels, expected 8 x 4");
    EXPECT_ERROR(read_sog(with_image(file, "shN_labels.webp", 4, 4, 0)), Code::kFormat,
                 "'shN_labels.webp' has 4 x 4 pixels");
    EXPECT_ERROR(read_sog(with_image(file, "shN_centroids.webp", 190, 1, 0)), Code::kFormat,
                 "is 190 pixels wide, expected 192");
    EXPECT_ERROR(read_sog(with_image(file, "quats.webp", 8, 4, 251)), Code::kFormat,
                 "pixel 0 has alpha 251, expected 252 to 255");
    EXPECT_ERROR(read_sog(with_image(file, "shN_labels.webp", 8, 4, 1)), Code::kFormat,
                 "pixel 0 names entry 257 of the palette, which has 20");
    // Without alpha, as libwebp writes images that are opaque everywhere.
    EXPECT_OK(read_sog(with_image(file, "quats.webp", 8, 4, 255)));
    Parts parts = unpack(file);
    part(parts, "sh0.webp") = bytes_of("RIFF");
    EXPECT_ERROR(read_sog(pack(parts)), Code::kFormat, "sog: 'sh0.webp': webp: ");
    parts = unpack(file);
    parts.emplace_back("readme.txt", bytes_of("text"));
    EXPECT_EQ(need(read_sog(pack(parts))).report.ignored,
              std::vector<std::string>{"1 files that meta.json does not name"});
}

TEST(Sog, ReadsVersion1) {
    const auto scene = need(scene::sort_morton(sample_scene(20, 1)));
    Parts parts = unpack(need(write_sog(scene)));
    part(parts, "meta.json") = bytes_of(
        R"({"means":{"shape":[20,3],"dtype":"float32","mins":[-1,-1,-1],"maxs":[1,1,1],
            "files":["means_l.webp","means_u.webp"]},
            "scales":{"shape":[20,3],"mins":[-3,-2,-1],"maxs":[0,0,254],"files":["scales.webp"]},
            "quats":{"shape":[20,4],"encoding":"quaternion_packed","files":["quats.webp"]},
            "sh0":{"shape":[20,1,4],"mins":[0,0,0,-5],"maxs":[1,1,1,5.2],"files":["sh0.webp"]},
            "shN":{"shape":[20,3],"mins":-1,"maxs":1.55,"files":["shN_centroids.webp",
            "shN_labels.webp"]}})");
    const auto same = need(read_sog(need(write_sog(scene)))).gaussians;
    const auto loaded = need(read_sog(pack(parts)));
    EXPECT_EQ(loaded.report.version, 1U);
    EXPECT_EQ(loaded.gaussians.sh_degree, 1U);
    EXPECT_EQ(loaded.gaussians.rotations, same.rotations);
    EXPECT_TRUE(loaded.report.ignored.empty());
    const auto scales = need(read_webp(part(parts, "scales.webp")));
    const auto colors = need(read_webp(part(parts, "sh0.webp")));
    for (std::size_t i = 0; i < 20; ++i) {
        EXPECT_FLOAT_EQ(loaded.gaussians.log_scales[3 * i + 2],
                        static_cast<float>(scales.samples[3 * i + 2]) - 1);
        EXPECT_NEAR(loaded.gaussians.opacity_logits[i], 0.04 * colors.samples[4 * i + 3] - 5, 1e-5);
    }
}

TEST_F(SogFolder, IsReadByItsFolderAndItsMeta) {
    const Buffer file = need(write_sog(sample_scene(30, 2)));
    const auto expected = need(read_sog(file)).gaussians;
    for (const auto& [name, bytes] : unpack(file)) ASSERT_OK(write_file(path(name), bytes));
    for (const std::string& place : {folder_.string(), path("meta.json")}) {
        const auto loaded = need(load_scene(place));
        EXPECT_EQ(loaded.report.format, "sog");
        test::expect_same_bits(loaded.gaussians, expected);
    }
    const Buffer meta = need(io::read_file(path("meta.json")));
    EXPECT_ERROR(read_scene(meta, "memory"), Code::kUnsupported, "read it by its path");
    std::filesystem::remove(path("quats.webp"));
    EXPECT_ERROR(load_scene(folder_.string()), Code::kFormat, "quats.webp");
    std::filesystem::remove(path("meta.json"));
    EXPECT_ERROR(load_scene(folder_.string()), Code::kIo, folder_.string());
    ASSERT_OK(write_file(path("a.sog"), file));
    test::expect_same_bits(need(load_scene(path("a.sog"))).gaussians, expected);
}

TEST(Sog, RefusesEveryPrefixAndSurvivesDamage) {
    auto scene = sample_scene(2, 1);
    for (auto* const values : {&scene.log_scales, &scene.sh}) std::ranges::fill(*values, 0.0F);
    const Buffer file = need(write_sog(scene));  // short codebooks
    test::expect_sturdy(file, [](Bytes bytes) {
        LoadOptions small;
        small.max_count = 1000;
        return read_sog(bytes, small).ok();
    });
}

TEST(SogReal, SceneOfSplatTransform) {
    SPLAT_NEEDS_REAL_DATA();
    const auto loaded = need(load_scene(*test::real_data_folder() + "/scenes/playbot_sog/5_0"));
    EXPECT_EQ(loaded.report.format, "sog");
    EXPECT_EQ(loaded.report.version, 2U);
    EXPECT_EQ(loaded.gaussians.count(), 3000U);
    EXPECT_EQ(loaded.gaussians.sh_degree, 2U);
    EXPECT_EQ(loaded.report.non_finite_values + loaded.report.bad_rotations, 0U);
    EXPECT_TRUE(loaded.report.ignored.empty());
}

}  // namespace
}  // namespace splat::io
