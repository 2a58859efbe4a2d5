// Maps without a network, and presets. Needs neither a device nor ONNX Runtime.
#include <cmath>
#include <limits>

#include "api/api_calls.h"

namespace splat::test {
namespace {

TEST(ApiPictureMaps, PresetsAreTexts) {
    const std::string names = text_of(splat_prior_preset, nullptr);
    EXPECT_EQ(names.rfind("[\"birefnet\", ", 0), 0U) << names;
    EXPECT_TRUE(holds(names, "\"u2net\"]"));
    const std::string preset = text_of(splat_prior_preset, "u2net");
    EXPECT_TRUE(holds(preset, "\"sha256\": \"8d10d2f3"));
    EXPECT_EQ(preset.rfind("{\"path\": \"", 0), 0U) << preset;
    EXPECT_TRUE(holds(preset, "/u2net.onnx\",\n"));
    EXPECT_REFUSED(splat_prior_preset("u3net", nullptr, 0, nullptr), kNotFound,
                   "did you mean 'u2net'?");
    const std::string own = preset.substr(preset.find("\"preset\": ") + 10);
    const std::string json = own.substr(0, own.rfind('}'));
    EXPECT_EQ(text_of(splat_prior_preset, json.c_str()), preset) << "presets of one's own are JSON";
}

TEST(ApiPictureMaps, MasksAreTheAlphaOrWhatTheBorderLeaves) {
    // A square of another colour in the middle.
    std::vector<std::uint8_t> rgb(8 * 8 * 3, 200), rgba;
    std::vector<std::uint8_t> expected(64, 0), alpha(64);
    for (std::size_t i = 0; i < 64; ++i) {
        const bool inside = i % 8 >= 2 && i % 8 < 5 && i / 8 >= 3 && i / 8 < 6;
        if (inside) rgb[3 * i] = 20;
        if (inside) expected[i] = 255;
        alpha[i] = static_cast<std::uint8_t>(i * 3);
        rgba.insert(rgba.end(), {rgb[3 * i], rgb[3 * i + 1], rgb[3 * i + 2], alpha[i]});
    }
    std::vector<std::uint8_t> mask(64, 9);
    splat_found found = 0;
    const splat_image to = packed_image(mask, 8, 8, 1);
    splat_image picture = packed_image(rgb, 8, 8, 3);
    EXPECT_DONE(splat_picture_mask(&picture, &to, &found));
    EXPECT_EQ(found, SPLAT_FOUND_BY_BORDER);
    EXPECT_EQ(mask, expected);
    picture = packed_image(rgba, 8, 8, 4);
    EXPECT_DONE(splat_picture_mask(&picture, &to, &found));
    EXPECT_EQ(found, SPLAT_FOUND_BY_ALPHA);
    EXPECT_EQ(mask, alpha) << "soft, as it is";
    for (std::size_t i = 0; i < 64; ++i) rgba[4 * i + 3] = 255;
    EXPECT_DONE(splat_picture_mask(&picture, &to, &found));
    EXPECT_EQ(found, SPLAT_FOUND_BY_BORDER) << "an alpha that leaves nothing out";
    EXPECT_EQ(mask, expected);
    std::vector<std::uint8_t> plain(8 * 8 * 3, 7);
    picture = packed_image(plain, 8, 8, 3);
    EXPECT_DONE(splat_picture_mask(&picture, &to, &found));
    EXPECT_EQ(found, SPLAT_FOUND_NOTHING);
    EXPECT_EQ(mask, std::vector<std::uint8_t>(64, 255));
}

/// Distances of a plane through (0, 0, 5) with this normal, seen with a focal length of 30 pixels.
Floats plane_depth(const double (&n)[3]) {
    Floats depth;
    for (int y = 0; y < 20; ++y)
        for (int x = 0; x < 24; ++x) {
            const double u = (x + 0.5 - 12) / 30, v = (y + 0.5 - 10) / 30;
            depth.push_back(static_cast<float>(5 * n[2] / (n[0] * u + n[1] * v + n[2])));
        }
    return depth;
}

TEST(ApiPictureMaps, NormalsOfPlanesAreExact) {
    const double planes[][3] = {{0, 0, -1}, {0.6, 0, -0.8}, {0, -0.6, -0.8}, {0.48, 0.36, -0.8}};
    for (const auto& n : planes) {
        Floats depth = plane_depth(n), normal(depth.size() * 3);
        auto desc = sized<splat_normals_desc>();
        desc.focal_x = desc.focal_y = 30;
        const splat_image from = packed_image(depth, 24, 20, 1),
                          to = packed_image(normal, 24, 20, 3);
        EXPECT_DONE(splat_normals_from_depth(&from, &desc, &to));
        for (std::size_t i = 0; i < normal.size(); ++i)
            EXPECT_NEAR(normal[i], (n[i % 3] + 1) / 2, 1e-4) << i;
        // The same from relative depth: 0 at twice the distance, 1 at half of it.
        Floats relative;
        for (const float z : depth) relative.push_back((1 / z - 0.1F) / (0.4F - 0.1F));
        desc.nearest = 2.5;
        desc.farthest = 10;
        Floats again(normal.size());
        const splat_image of = packed_image(relative, 24, 20, 1),
                          into = packed_image(again, 24, 20, 3);
        EXPECT_DONE(splat_normals_from_depth(&of, &desc, &into));
        for (std::size_t i = 0; i < normal.size(); ++i) EXPECT_NEAR(again[i], normal[i], 1e-3);
    }
}

TEST(ApiPictureMaps, NormalsDoNotBendAtEdgesAndHolesHaveNone) {
    const double facing[3] = {0, 0, -1};
    Floats depth = plane_depth(facing);
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (i % 24 >= 12) depth[i] = 9;  // a step
    depth[24 * 5 + 3] = 0;
    depth[24 * 7 + 4] = std::numeric_limits<float>::quiet_NaN();
    std::vector<std::uint8_t> normal(depth.size() * 3);
    auto desc = sized<splat_normals_desc>();
    desc.focal_x = desc.focal_y = 30;
    const splat_image from = packed_image(depth, 24, 20, 1), to = packed_image(normal, 24, 20, 3);
    EXPECT_DONE(splat_normals_from_depth(&from, &desc, &to));
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const bool hole = i == 24 * 5 + 3 || i == 24 * 7 + 4;
        EXPECT_EQ(normal[3 * i + 2], hole ? 127 : 0) << i;
        EXPECT_EQ(normal[3 * i], 127) << i;
    }
}

}  // namespace
}  // namespace splat::test
