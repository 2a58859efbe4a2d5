#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <limits>

#include "core/json_tree.h"
#include "io/file.h"
#include "io/sample_files.h"
#include "io/sample_scene.h"
#include "io/scene_formats.h"
#include "io/scenes/gltf.h"
#include "io/scenes/sample_gltf.h"
#include "scene/activate.h"
#include "scene/arrays.h"
#include "scene/sh.h"
#include "scene/transform.h"
#include "support/expect_status.h"
#include "support/log_capture.h"

namespace splat::io {
namespace {

using namespace test;
using scene::Gaussians;

constexpr float kNotANumber = std::numeric_limits<float>::quiet_NaN();

Gaussians read_sample(const SampleGltf& sample, const LoadOptions& options = {}) {
    return need(read_glb(sample.glb(), options)).gaussians;
}

/// The same in the axes of the file.
Gaussians in_file_axes(const SampleGltf& sample) {
    LoadOptions options;
    options.frame = scene::Frame::kRdf;
    return read_sample(sample, options);
}

void expect_close(const Gaussians& a, const Gaussians& b, double bound) {
    EXPECT_LT(max_difference(a.means, b.means), 10 * bound);
    EXPECT_LT(max_difference(a.log_scales, b.log_scales), bound);
    EXPECT_LT(max_angle(a.rotations, b.rotations), 1e-3);  // acos() near 1 loses half the digits
    EXPECT_LT(max_difference(a.opacity_logits, b.opacity_logits), bound);
    EXPECT_LT(max_difference(a.sh, b.sh), bound);
}

/// Exact but for exp and log of scales, and the sigmoid of opacities near 1.
TEST(Gltf, RoundTripIsWithinTheRounding) {
    for (std::uint32_t degree = 0; degree <= 3; ++degree) {
        const Gaussians scene = sample_scene(40, degree);
        const Buffer files[] = {need(write_gltf(scene)), need(write_glb(scene))};
        const LoadedScene from[] = {need(read_gltf(files[0])), need(read_glb(files[1]))};
        for (const LoadedScene& loaded : from) {
            const Gaussians& g = loaded.gaussians;
            EXPECT_EQ(g.means, scene.means);
            EXPECT_EQ(g.sh, scene.sh);
            EXPECT_EQ(g.rotations, scene.rotations);
            EXPECT_LT(max_difference(g.log_scales, scene.log_scales), 1e-6);
            for (std::size_t i = 0; i < g.count(); ++i)
                EXPECT_NEAR(scene::opacity_of(static_cast<double>(g.opacity_logits[i])),
                            scene::opacity_of(static_cast<double>(scene.opacity_logits[i])),
                            std::ldexp(1.01, -25));
            EXPECT_EQ(loaded.report.frame, scene::Frame::kLuf);
            EXPECT_EQ(loaded.report.version, 2U);
            EXPECT_TRUE(loaded.report.ignored.empty());
            EXPECT_TRUE(g.drawn_as.by_distance && g.drawn_as.three_sigma);
            EXPECT_FALSE(g.drawn_as.linear_colors || g.drawn_as.antialiased);
        }
        expect_same_bits(from[0].gaussians, from[1].gaussians);
    }
}

TEST(Gltf, ReadsTheLayout) {
    for (const bool text : {false, true}) {
        const SampleGltf sample = sample_gltf();
        const auto g = need(text ? read_gltf(sample.gltf()) : read_glb(sample.glb())).gaussians;
        ASSERT_EQ(g.count(), 2U);
        EXPECT_EQ(g.means, (std::vector<float>{-1, -2, 3, -4, -5, 6})) << "+Y up, -X right";
        EXPECT_EQ(g.log_scales[0], 0);
        EXPECT_NEAR(g.log_scales[3], std::log(2.0), 1e-7);
        EXPECT_NEAR(g.opacity_logits[0], std::log(0.25 / 0.75), 1e-7);
        EXPECT_EQ(g.opacity_logits[1], 0);
        EXPECT_EQ(g.rotations[0], 1) << "w comes first in memory";
        EXPECT_NEAR(g.rotations[4], std::sqrt(0.5), 1e-6);
        EXPECT_NEAR(g.rotations[7], std::sqrt(0.5), 1e-6);
        EXPECT_EQ(g.sh, (std::vector<float>{0.1F, 0.2F, 0.3F, 0.4F, 0.5F, 0.6F}));
    }
}

/// The document that is written, in JSON.
JsonTree written_document(const Gaussians& scene) {
    const Buffer file = need(write_gltf(scene));
    return need(parse_json_tree(as_text(file), "test"));
}

TEST(Gltf, WritesWhatOtherProgramsNeed) {
    Gaussians scene = sample_scene(2, 1);
    scene.means = {1, -2, 3, -4, 5, 6};
    scene.opacity_logits = {0, 1000};
    const double srgb[] = {0.5, 0.02, 2};
    for (std::size_t k = 0; k < 3; ++k)
        scene.sh[k] = static_cast<float>((srgb[k] - 0.5) / scene::kSh0);
    const JsonTree json = written_document(scene);
    EXPECT_EQ(json["extensionsUsed"].items().size(), 1U);
    EXPECT_EQ(json.find("extensionsRequired"), nullptr);
    const JsonTree& primitive = json["meshes"].items()[0]["primitives"].items()[0];
    EXPECT_EQ(primitive["mode"].count(), 0U);
    const JsonTree& extension = primitive["extensions"]["KHR_gaussian_splatting"];
    EXPECT_EQ(*extension["colorSpace"].text(), "srgb_rec709_display");
    EXPECT_EQ(*extension["sortingMethod"].text(), "cameraDistance");
    const JsonTree& position = json["accessors"].items()[0];
    const double low[] = {-1, -5, 3}, high[] = {4, 2, 6};
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(position["min"].items()[k].number(), low[k]);
        EXPECT_EQ(position["max"].items()[k].number(), high[k]);
    }
    // Points in programs without the extension: linear, clipped colours, and opacities.
    const Buffer glb = need(write_glb(scene));
    const std::size_t start = as_text(glb).find(std::string_view("BIN\0", 4)) + 4 + 24;
    const double linear[] = {0.21404114, 0.02 / 12.92, 1, 0.5};
    for (std::size_t k = 0; k < 4; ++k)
        EXPECT_EQ(number<std::uint16_t>(glb.data() + start + 2 * k),
                  std::lround(65535 * linear[k]));
    EXPECT_EQ(glb.size() % 4, 0U);
    EXPECT_EQ(number<std::uint32_t>(glb.data() + 8), glb.size());
}

TEST(Gltf, ColoursMayBeLinear) {
    Gaussians scene = sample_scene(2, 0);
    scene.drawn_as.linear_colors = true;
    scene.sh[0] = 0;
    const Buffer file = need(write_glb(scene));
    const auto loaded = need(read_glb(file));
    EXPECT_TRUE(loaded.gaussians.drawn_as.linear_colors && loaded.report.drawn_as.linear_colors);
    EXPECT_EQ(loaded.gaussians.sh, scene.sh);
    const std::size_t start = as_text(file).find(std::string_view("BIN\0", 4)) + 4 + 24;
    EXPECT_EQ(number<std::uint16_t>(file.data() + start), 32768) << "0.5 stays 0.5";

    SampleGltf both = sample_gltf();
    std::string other = both.primitive;
    other.replace(other.find("srgb"), 4, "lin");
    std::string attributes;
    for (const auto& [name, index] : both.attributes)
        attributes += (attributes.empty() ? "\"" : ",\"") + name + "\":" + std::to_string(index);
    both.mesh = R"(,{"attributes":{)" + attributes + "}," + other + "}";
    EXPECT_ERROR(read_glb(both.glb()), Code::kUnsupported,
                 "meshes[0].primitives[1] has another colorSpace than meshes[0].primitives[0]");
    other.replace(other.find("lin"), 3, "dcip3");
    both.primitive = other;
    EXPECT_ERROR(read_glb(both.glb()), Code::kUnsupported, "colorSpace 'dcip3_rec709_display'");
}

TEST(Gltf, ExtremesOfOpacitiesAndScales) {
    Gaussians scene = sample_scene(2, 0);
    scene.opacity_logits = {1000, -std::numeric_limits<float>::infinity()};
    scene.log_scales[0] = -std::numeric_limits<float>::infinity();  // a flat one
    const auto loaded = need(read_glb(need(write_glb(scene))));
    EXPECT_EQ(loaded.gaussians.opacity_logits, (std::vector<float>{40, -40}));
    EXPECT_EQ(loaded.gaussians.log_scales[0], scene.log_scales[0]);
    EXPECT_EQ(loaded.report.non_finite_values, 1U);

    const auto refused = [&](std::vector<float> Gaussians::*array, float value, const char* part) {
        Gaussians bad = sample_scene(3, 1);
        (bad.*array)[(bad.*array).size() / 3] = value;  // in the second
        EXPECT_ERROR(write_glb(bad), Code::kInvalidArgument, part);
        EXPECT_ERROR(write_gltf(bad), Code::kInvalidArgument, part);
    };
    for (const auto array :
         {&Gaussians::means, &Gaussians::rotations, &Gaussians::sh, &Gaussians::opacity_logits})
        refused(array, kNotANumber, "gltf: Gaussian 1 has a value that is not finite");
    for (const float scale : {kNotANumber, 90.0F, -110.0F, std::numeric_limits<float>::infinity()})
        refused(&Gaussians::log_scales, scale, "gltf: Gaussian 1 has a log scale of");
}

TEST(Gltf, WarnsOfWhatItCannotSay) {
    Gaussians scene = sample_scene(2, 0);
    {
        const LogCapture log;
        EXPECT_OK(write_glb(scene));
        EXPECT_EQ(log.text(), "");
    }
    std::fill_n(scene.rotations.begin(), 4, 0.0F);
    const LogCapture log;
    const auto loaded = need(read_glb(need(write_glb(scene))));
    EXPECT_TRUE(holds(log.text(), "gltf: 1 of 2 rotations have length 0"));
    EXPECT_EQ(loaded.gaussians.rotations[0], 1) << "files hold unit quaternions";
    EXPECT_EQ(loaded.report.bad_rotations, 0U);
}

TEST(Gltf, ASceneWithoutGaussians) {
    for (const bool text : {false, true}) {
        const Buffer file = need(text ? write_gltf({}) : write_glb({}));
        EXPECT_EQ(need(text ? read_gltf(file) : read_glb(file)).gaussians.count(), 0U);
    }
    SampleGltf surfaces = sample_gltf();
    surfaces.primitive = R"("mode":4)";
    EXPECT_EQ(need(read_glb(surfaces.glb())).report.ignored,
              std::vector<std::string>{"primitives without KHR_gaussian_splatting"});
    surfaces.used = R"("extensionsUsed":[])";
    EXPECT_ERROR(read_glb(surfaces.glb()), Code::kUnsupported,
                 "no mesh of the scene has KHR_gaussian_splatting");
}

/// What an attribute becomes with these integers.
template <class T>
std::vector<float> encoded(const char* name, const std::vector<T>& values, int component,
                           const char* type, bool normalized,
                           std::vector<float> Gaussians::*array) {
    SampleGltf sample = sample_gltf();
    sample.add<T>(name, values, component, type, values.size() / 2, normalized);
    return in_file_axes(sample).*array;
}

TEST(Gltf, IntegersOfEachEncoding) {
    const auto logit = [](double opacity) { return std::log(opacity / (1 - opacity)); };
    const std::string opacity = gltf_attribute("OPACITY");
    auto logits = encoded<std::uint8_t>(opacity.c_str(), {51, 255}, kGltfUbyte, "SCALAR", true,
                                        &Gaussians::opacity_logits);
    EXPECT_NEAR(logits[0], logit(0.2), 1e-6);
    EXPECT_EQ(logits[1], 40);
    logits = encoded<std::uint16_t>(opacity.c_str(), {13107, 0}, kGltfUshort, "SCALAR", true,
                                    &Gaussians::opacity_logits);
    EXPECT_NEAR(logits[0], logit(0.2), 1e-6);
    EXPECT_EQ(logits[1], -40);

    const std::string scale = gltf_attribute("SCALE");
    const auto scales = [&](auto number, int component, bool normalized, double most) {
        using T = decltype(number);
        const auto logs = encoded<T>(scale.c_str(), {1, 2, 3, 4, 5, 200}, component, "VEC3",
                                     normalized, &Gaussians::log_scales);
        EXPECT_NEAR(logs[1], std::log(2 / most), 1e-6);
        EXPECT_NEAR(logs[5], std::log(200 / most), 1e-6);
    };
    scales(std::uint8_t{}, kGltfUbyte, true, 255);
    scales(std::uint8_t{}, kGltfUbyte, false, 1);
    scales(std::uint16_t{}, kGltfUshort, true, 65535);
    scales(std::uint16_t{}, kGltfUshort, false, 1);

    const std::string rotation = gltf_attribute("ROTATION");
    const auto turned = [&](auto number, int component, int most) {
        using T = decltype(number);
        const T half = static_cast<T>(std::lround(most * std::sqrt(0.5)));
        const auto minus = static_cast<T>(-most - 1);  // stands for -1, too
        const auto q = encoded<T>(rotation.c_str(), {0, half, 0, half, 0, 0, minus, 0}, component,
                                  "VEC4", true, &Gaussians::rotations);
        EXPECT_NEAR(q[0], std::sqrt(0.5), 1e-6) << "normalised after reading";
        EXPECT_NEAR(q[2], std::sqrt(0.5), 1e-6);
        EXPECT_EQ(q[7], -1);
    };
    turned(std::int8_t{}, kGltfByte, 127);
    turned(std::int16_t{}, kGltfShort, 32767);
}

TEST(Gltf, RefusesOtherEncodings) {
    const auto refused = [](const char* name, int component, const char* type, std::size_t each,
                            bool normalized, const char* part) {
        SampleGltf sample = sample_gltf();
        sample.add<float>(name, std::vector<float>(2 * each), component, type, each, normalized);
        EXPECT_ERROR(read_glb(sample.glb()), Code::kFormat, part);
    };
    refused("POSITION", kGltfShort, "VEC3", 3, false, "type 'short', expected float");
    refused("POSITION", kGltfFloat, "VEC2", 2, false, "POSITION: 2 numbers each, expected 3");
    refused("KHR_gaussian_splatting:SCALE", kGltfByte, "VEC3", 3, true,
            "SCALE: numbers of type 'normalized byte', expected float, unsigned byte, ");
    refused("KHR_gaussian_splatting:ROTATION", kGltfByte, "VEC4", 4, false, "type 'byte'");
    refused("KHR_gaussian_splatting:OPACITY", kGltfUbyte, "SCALAR", 1, false, "'unsigned byte'");
    refused("KHR_gaussian_splatting:SH_DEGREE_0_COEF_0", kGltfUbyte, "VEC3", 3, true, "float");
    refused("POSITION", kGltfFloat, "MAT3", 9, false, "none of SCALAR, VEC2, VEC3 and VEC4");
    refused("POSITION", kGltfFloat, "VEC3", 3, true, "a normalized float");
    refused("POSITION", 5124, "VEC3", 3, false, "componentType 5124");

    SampleGltf quantized = sample_gltf();
    quantized.used += R"(,"extensionsRequired":["KHR_mesh_quantization"])";
    quantized.add<std::int16_t>("POSITION", {1, -2, 3, 4, 5, -600}, kGltfShort, "VEC3", 3);
    EXPECT_EQ(in_file_axes(quantized).means, (std::vector<float>{1, -2, 3, 4, 5, -600}));
}

TEST(Gltf, NegativeScalesAreLogarithmsOfDrafts) {
    SampleGltf sample = sample_gltf();
    sample.add<float>(gltf_attribute("SCALE"), {-1, 0, 1, -4, 0.5F, 2}, kGltfFloat, "VEC3", 3);
    const auto loaded = need(read_glb(sample.glb()));
    EXPECT_EQ(loaded.gaussians.log_scales, (std::vector<float>{-1, 0, 1, -4, 0.5F, 2}));
    ASSERT_EQ(loaded.report.ignored.size(), 1U);
    EXPECT_TRUE(holds(loaded.report.ignored[0], "read as logarithms"));
}

TEST(Gltf, RefusesOpacitiesOutsideTheirRange) {
    for (const float value : {-0.01F, 1.01F}) {
        SampleGltf sample = sample_gltf();
        sample.add<float>(gltf_attribute("OPACITY"), {0.5F, value}, kGltfFloat, "SCALAR", 1);
        EXPECT_ERROR(read_glb(sample.glb()), Code::kFormat, "of Gaussian 1, expected 0 to 1");
    }
    SampleGltf sample = sample_gltf();
    sample.add<float>(gltf_attribute("OPACITY"), {0.5F, kNotANumber}, kGltfFloat, "SCALAR", 1);
    EXPECT_EQ(need(read_glb(sample.glb())).report.non_finite_values, 1U);
}

/// A sample with harmonics of these degrees, from 1 on; without the last coefficient of the highest one if `cut`.
SampleGltf with_harmonics(std::vector<std::uint32_t> degrees, bool cut = false) {
    SampleGltf sample = sample_gltf();
    float next = 0.01F;
    for (const std::uint32_t degree : degrees)
        for (std::uint32_t order = 0; order < 2 * degree + 1; ++order) {
            if (cut && degree == degrees.back() && order == 2 * degree) continue;
            std::vector<float> values;
            for (int i = 0; i < 6; ++i) values.push_back(next += 0.01F);
            sample.add<float>(gltf_attribute(format("SH_DEGREE_%u_COEF_%u", degree, order)), values,
                              kGltfFloat, "VEC3", 3);
        }
    return sample;
}

TEST(Gltf, HarmonicsOfWholeDegrees) {
    const Gaussians g = in_file_axes(with_harmonics({1, 2, 3}));
    EXPECT_EQ(g.sh_degree, 3U);
    float next = 0.01F;
    for (std::size_t k = 1; k < 16; ++k)
        for (std::size_t i = 0; i < 2; ++i)
            for (std::size_t color = 0; color < 3; ++color)
                EXPECT_EQ(g.sh[(i * 16 + k) * 3 + color], next += 0.01F);
    EXPECT_ERROR(read_glb(with_harmonics({1, 2}, true).glb()), Code::kFormat,
                 "4 of 5 harmonics of degree 2, expected whole degrees");
    EXPECT_ERROR(read_glb(with_harmonics({2}).glb()), Code::kFormat,
                 "5 of 5 harmonics of degree 2, but not all of the degree below");
    SampleGltf none = sample_gltf();
    none.attributes.erase(gltf_attribute("SH_DEGREE_0_COEF_0"));
    EXPECT_ERROR(read_glb(none.glb()), Code::kFormat, "0 of 1 harmonics of degree 0");
}

/// What a node does to Gaussians that lie in the file's axes.
Gaussians moved(SampleGltf sample, const std::string& node) {
    sample.nodes = R"([{"mesh":0,)" + node + "}]";
    return in_file_axes(sample);
}

TEST(Gltf, NodesMoveTurnAndScale) {
    const SampleGltf sample = with_harmonics({1, 2, 3});
    const scene::Similarity similarity = {{0.5, 0.1, -0.7, 0.5}, {1, -2, 0.5}, 2.5};
    Gaussians expected = in_file_axes(sample);
    ASSERT_OK(scene::transform(expected, similarity));
    const scene::Quaternion q = glm::normalize(similarity.rotation);
    const std::string rotation = format("[%.17g,%.17g,%.17g,%.17g]", q.x, q.y, q.z, q.w);
    expect_close(
        moved(sample, R"("translation":[1,-2,0.5],"scale":[2.5,2.5,2.5],"rotation":)" + rotation),
        expected, 1e-6);
    const scene::Mat3 m = 2.5 * glm::mat3_cast(q);
    // Column by column: three of the rotation with a 0 each, then the translation with a 1.
    std::string matrix = R"("matrix":[)";
    for (std::size_t column = 0; column < 3; ++column)
        matrix += format("%.9g,%.9g,%.9g,0,", m[column][0], m[column][1], m[column][2]);
    expect_close(moved(sample, matrix + "1,-2,0.5,1]"), expected, 1e-5);

    // The same in three nodes, of which the last one has the mesh.
    SampleGltf chain = sample;
    chain.nodes = R"([{"mesh":0,"scale":[2.5,2.5,2.5]},{"translation":[1,-2,0.5],"children":[2]},)"
                  R"({"rotation":)" +
                  rotation + R"(,"children":[0]}])";
    chain.roots = "[1]";
    expect_close(in_file_axes(chain), expected, 1e-6);
    EXPECT_EQ(moved(sample, R"("translation":[0,0,0],"scale":[1,1,1])").sh, in_file_axes(sample).sh)
        << "identity keeps the bits";
}

/// R S S^T R^T of a Gaussian.
scene::Mat3 covariance_of(const Gaussians& g, std::size_t i) {
    scene::Mat3 axes = glm::mat3_cast(scene::rotation_at(g, i));
    for (std::size_t k = 0; k < 3; ++k)
        axes[k] *= std::exp(static_cast<double>(g.log_scales[3 * i + k]));
    return axes * glm::transpose(axes);
}

/// Scales that differ by axis: M C C^T M^T, harmonics by the rotation alone.
TEST(Gltf, NodesStretch) {
    SampleGltf sample = with_harmonics({1});
    sample.add<float>(gltf_attribute("SCALE"), {1, 0.1F, 1e-4F, 2, 0, 0.5F}, kGltfFloat, "VEC3", 3);
    sample.add<float>(gltf_attribute("ROTATION"),
                      {0.5F, -0.5F, 0.1F, std::sqrt(0.49F), 0, 0.6F, 0, 0.8F}, kGltfFloat, "VEC4",
                      4);
    const std::string turn = R"("rotation":[0.6,0,0,0.8])";
    const Gaussians before = in_file_axes(sample);
    const Gaussians g = moved(sample, turn + R"(,"scale":[3,0.5,1],"translation":[7,8,9])");
    const scene::Mat3 rotation = glm::mat3_cast(scene::Quaternion(0.8, 0.6, 0, 0));
    const scene::Mat3 m = rotation * scene::Mat3(3, 0, 0, 0, 0.5, 0, 0, 0, 1);
    for (std::size_t i = 0; i < 2; ++i) {
        const scene::Mat3 expected = m * covariance_of(before, i) * glm::transpose(m);
        const scene::Mat3 found = covariance_of(g, i);
        for (std::size_t k = 0; k < 9; ++k)
            EXPECT_NEAR(found[k / 3][k % 3], expected[k / 3][k % 3], 1e-5) << i << " " << k;
        const scene::Vec3 mean =
            m * scene::Vec3(glm::make_vec3(&before.means[3 * i])) + scene::Vec3(7, 8, 9);
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(g.means[3 * i + k], mean[k], 1e-5);
    }
    // The volume is multiplied by the determinant, also of needles; a flat one stays flat.
    const auto volume = [](const Gaussians& of) {
        return of.log_scales[0] + of.log_scales[1] + of.log_scales[2];
    };
    EXPECT_NEAR(volume(g) - volume(before), std::log(1.5), 1e-5);
    EXPECT_EQ(std::ranges::count(g.log_scales, -std::numeric_limits<float>::infinity()), 1);
    EXPECT_LT(max_difference(g.sh, moved(sample, turn).sh), 1e-6);
    expect_close(g, moved(sample, turn + R"(,"scale":[3,0.5,1.0000001],"translation":[7,8,9])"),
                 1e-4);
}

TEST(Gltf, RefusesNodesWithoutADrawing) {
    const auto refused = [](const std::string& node, Code code, const char* part) {
        SampleGltf sample = sample_gltf();
        sample.nodes = R"([{"mesh":0,)" + node + "}]";
        EXPECT_ERROR(read_glb(sample.glb()), code, part);
    };
    refused(R"("scale":[-1,1,1])", Code::kUnsupported, "nodes[0] mirrors its mesh");
    refused(R"("matrix":[1,0,0,0,1,1,0,0,0,0,1,0,0,0,0,1])", Code::kUnsupported, "nodes[0] shears");
    refused(R"("scale":[0,1,1])", Code::kFormat, "scales an axis of its mesh by 0");
    refused(R"("scale":[1e300,1e300,1e300],"children":[])", Code::kFormat, "its mesh by inf");
    refused(R"("scale":[1e38,3e38,1e38])", Code::kFormat, "nodes[0] moves Gaussian 0 beyond");
    refused(R"("rotation":[0,0,0,2])", Code::kFormat, "a rotation of length 2, expected 1");
    refused(R"("rotation":[0,0,0])", Code::kFormat, "no array of 4 finite numbers");
    refused(R"("translation":[0,0,1e999])", Code::kFormat, "");
    refused(R"("translation":[0,0,null])", Code::kFormat, "no array of 3 finite numbers");
    refused(R"("matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[1,1,1])", Code::kFormat,
            "a matrix and a scale");
    refused(R"("matrix":[1,0,0,5,0,1,0,0,0,0,1,0,0,0,0,1])", Code::kFormat, "the last row");
    refused(R"("children":[0])", Code::kFormat, "nodes[0] is reached twice, expected a tree");
    refused(R"("children":[1])", Code::kFormat, "a node is named that is not there; there are 1");
}

TEST(Gltf, SeveralMeshesNodesAndPrimitives) {
    SampleGltf sample = sample_gltf();
    const std::string first = sample.json();
    const std::size_t at = first.find(R"({"attributes")");
    const std::string primitive = first.substr(at, first.find("]}],\"buffers") - at);
    sample.mesh = "," + primitive;
    sample.nodes =
        R"([{"mesh":0},{"mesh":0,"translation":[10,0,0]},{"children":[0,1]},{"mesh":0}])";
    sample.roots = "[2]";
    const Gaussians g = in_file_axes(sample);
    ASSERT_EQ(g.count(), 8U) << "two nodes of two primitives; the last node is in no scene";
    const float x[] = {1, 4, 1, 4, 11, 14, 11, 14};
    for (std::size_t i = 0; i < 8; ++i) EXPECT_EQ(g.means[3 * i], x[i]);
    EXPECT_EQ(g.opacity_logits[6], g.opacity_logits[0]);

    LoadOptions few;
    few.max_count = 7;
    EXPECT_ERROR(read_glb(sample.glb(), few), Code::kUnsupported, "gltf: 8 Gaussians");
}

TEST(Gltf, DegreesOfPrimitivesMayDiffer) {
    SampleGltf sample = with_harmonics({1});
    const std::string whole = sample.json();
    SampleGltf flat = sample;
    for (int order = 0; order < 3; ++order)
        flat.attributes.erase(gltf_attribute(format("SH_DEGREE_1_COEF_%d", order)));
    const std::string first = flat.json();
    const std::size_t at = first.find(R"({"attributes")");
    sample.mesh = "," + first.substr(at, first.find("]}],\"buffers") - at);
    const Gaussians g = in_file_axes(sample);
    ASSERT_EQ(g.count(), 4U);
    EXPECT_EQ(g.sh_degree, 1U);
    EXPECT_NE(g.sh[3], 0);
    for (std::size_t k = 3; k < 12; ++k) EXPECT_EQ(g.sh[24 + k], 0);
    EXPECT_EQ(g.sh[24], 0.1F);
}

}  // namespace
}  // namespace splat::io
