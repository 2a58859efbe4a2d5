// Maps without a network, and presets. Needs neither a device nor ONNX Runtime.
#include <array>
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

/// Two planes side by side: one through (0, 0, 5), the other at z = 9.
Floats two_planes() {
    Floats depth = plane_depth({0.6, 0, -0.8});
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (i % 24 >= 14) depth[i] = 9;
    depth[3] = 0;
    depth[4] = std::numeric_limits<float>::quiet_NaN();
    return depth;
}

TEST(ApiPictureMaps, RelativeDepthOfZeroHasNoPlane) {
    Floats depth(24 * 20, 0), plane(depth.size() * 4);
    for (std::size_t i = 0; i < depth.size(); ++i)
        if (i % 24 < 12) depth[i] = 0.5F;
    auto camera = sized<splat_normals_desc>();
    camera.focal_x = camera.focal_y = 30;
    camera.nearest = 1;
    camera.farthest = 4;
    const splat_image from = packed_image(depth, 24, 20, 1), to = packed_image(plane, 24, 20, 4);
    std::uint32_t count = 9;
    EXPECT_DONE(splat_planes_from_depth(&from, nullptr, &camera, nullptr, &to, &count));
    EXPECT_EQ(count, 1U);
    for (std::size_t i = 0; i < depth.size(); ++i)
        EXPECT_EQ(plane[4 * i + 3] > 0, i % 24 < 12) << i;
}

TEST(ApiPictureMaps, PlanesAreNumbersOrFromZeroToOne) {
    Floats depth = two_planes(), plane(depth.size() * 4), share(plane.size());
    std::vector<std::uint8_t> bytes(plane.size());
    auto camera = sized<splat_normals_desc>();
    camera.focal_x = camera.focal_y = 30;
    auto desc = sized<splat_planes_desc>();
    desc.flags = SPLAT_NORMAL_VECTORS;
    const splat_image from = packed_image(depth, 24, 20, 1), to = packed_image(plane, 24, 20, 4),
                      shares = packed_image(share, 24, 20, 4),
                      in_bytes = packed_image(bytes, 24, 20, 4);
    std::uint32_t count = 9;
    EXPECT_DONE(splat_planes_from_depth(&from, nullptr, &camera, &desc, &to, &count));
    EXPECT_EQ(count, 2U);
    EXPECT_DONE(splat_planes_from_depth(&from, nullptr, &camera, nullptr, &shares, nullptr));
    EXPECT_DONE(splat_planes_from_depth(&from, nullptr, &camera, nullptr, &in_bytes, nullptr));
    for (std::size_t i = 0; i < depth.size(); ++i) {
        const bool right = i % 24 >= 14, none = i == 3 || i == 4;
        const double n[] = {right ? 0 : 0.6, 0, right ? -1 : -0.8, right ? 9.0 : 4.0};
        for (std::size_t k = 0; k < 4; ++k) {
            const double unit = k < 3 ? (n[k] + 1) / 2 : n[k] / 9;
            EXPECT_NEAR(plane[4 * i + k], none ? 0 : n[k], 1e-4) << i << " " << k;
            EXPECT_NEAR(share[4 * i + k], none ? 0 : unit, 1e-4) << i << " " << k;
            EXPECT_NEAR(bytes[4 * i + k], none ? 0 : 255 * unit, 0.51) << i << " " << k;
        }
    }
    EXPECT_REFUSED(splat_planes_from_depth(&from, nullptr, &camera, &desc, &in_bytes, nullptr),
                   kArgument, "plane has bytes, expected F16 or F32");
    desc.least_share = 0.5;
    EXPECT_DONE(splat_planes_from_depth(&from, nullptr, &camera, &desc, &to, &count));
    EXPECT_EQ(count, 1U) << "the other has 200 of 480 pixels";
}

TEST(ApiPictureMaps, PlanesTakeNormalMaps) {
    Floats depth = two_planes(), plane(depth.size() * 4), normal;
    for (std::size_t i = 0; i < depth.size(); ++i)
        for (const float n :
             i % 24 >= 14 ? std::array{0.5F, 0.5F, 0.0F} : std::array{0.5F, 0.5F, 0.5F})
            normal.push_back(n);  // the left plane has none
    auto camera = sized<splat_normals_desc>();
    camera.focal_x = camera.focal_y = 30;
    const splat_image from = packed_image(depth, 24, 20, 1), with = packed_image(normal, 24, 20, 3),
                      to = packed_image(plane, 24, 20, 4);
    std::uint32_t count = 0;
    EXPECT_DONE(splat_planes_from_depth(&from, &with, &camera, nullptr, &to, &count));
    EXPECT_EQ(count, 1U);
    EXPECT_EQ(plane[4 * 24 * 10 + 3], 0);
    EXPECT_EQ(plane[4 * (24 * 10 + 20) + 3], 1);
}

}  // namespace
}  // namespace splat::test
