#include "fit/prior_maps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "scene/camera_pose.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

constexpr std::uint32_t kSide = 48;
constexpr double kWall = 5;

/// The distance along the axis of a wall z = 5 with a ball of radius 1 before it, whose centre is (0, 0, 3).
double depth_of(const scene::Vec3& center, const scene::Vec3& ray) {
    const scene::Vec3 to = center - scene::Vec3(0, 0, 3);
    const double a = glm::dot(ray, ray), b = glm::dot(to, ray), c = glm::dot(to, to) - 1;
    const double root = b * b - a * c;
    return root > 0 ? (-b - std::sqrt(root)) / a : kWall - center.z;
}

/// A photograph from (x, 0, 0) along z, whose map is the truth, scaled and shifted.
data::PosedPhoto photo_from(double x, double scale, double shift) {
    data::PosedPhoto photo;
    photo.width = photo.height = kSide;
    photo.camera = {"", kSide, kSide, kSide, kSide, kSide / 2.0, kSide / 2.0, {}};
    photo.camera.world_to_camera = scene::make_pose(scene::Mat3(1), scene::Vec3(-x, 0, 0));
    for (std::uint32_t i = 0; i < kSide * kSide; ++i) {
        const scene::Vec3 ray((i % kSide + 0.5) / kSide - 0.5, (i / kSide + 0.5) / kSide - 0.5, 1);
        const double inverse = 1 / depth_of({x, 0, 0}, ray);
        photo.nearness.push_back(static_cast<float>((inverse - shift) / scale));
        photo.pixels.push_back(255U << 24 | i % 256);
    }
    return photo;
}

/// Points on the wall, also behind the ball, and on both sides of the ball.
std::vector<scene::Vec3> points() {
    std::vector<scene::Vec3> made;
    Rng rng(1);
    for (int i = 0; i < 150; ++i) {
        made.emplace_back(4 * rng.uniform() - 2, 4 * rng.uniform() - 2, kWall);
        const scene::Vec3 d(rng.uniform() - 0.5, rng.uniform() - 0.5, rng.uniform() - 0.5);
        made.push_back(scene::Vec3(0, 0, 3) + glm::normalize(d));
    }
    return made;
}

TEST(PriorMaps, AreAlignedThoughPointsAreHidden) {
    const data::PosedPhoto photo = photo_from(0, 0.7, -0.1);
    const auto found = fit::aligned_to_points(photo, points());
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->scale, 0.7, 0.02);
    EXPECT_NEAR(found->shift, -0.1, 0.01);
    EXPECT_GT(found->mean, 0.19);
    EXPECT_LT(found->mean, 0.3);
}

TEST(PriorMaps, AreNotAlignedWithoutPointsOrUpsideDown) {
    data::PosedPhoto photo = photo_from(0, 0.7, -0.1);
    const std::vector<scene::Vec3> all = points();
    EXPECT_FALSE(fit::aligned_to_points(photo, std::span(all).first(10)));
    for (float& p : photo.nearness) p = 0.25F;
    EXPECT_FALSE(fit::aligned_to_points(photo, all));
    photo.nearness.clear();
    EXPECT_FALSE(fit::aligned_to_points(photo, all));
}

TEST(PriorMaps, GivePointsOnWhatTheyShow) {
    std::vector<data::PosedPhoto> photos;
    for (const double x : {-0.5, 0.0, 0.5}) photos.push_back(photo_from(x, 0.5 + 0.1 * x, 0.05));
    // A floating stripe that the others see through.
    for (std::uint32_t i = 20 * kSide; i < 24 * kSide; ++i)
        photos[1].nearness[i] = static_cast<float>((1 / 1.2 - 0.05) / 0.5);
    std::vector<std::optional<fit::PriorAlignment>> alignments;
    for (const double x : {-0.5, 0.0, 0.5})
        alignments.push_back(fit::PriorAlignment{0.5 + 0.1 * x, 0.05, 0.25});
    const io::ColoredPoints made = fit::dense_points(photos, alignments, 1700);
    EXPECT_GT(made.positions.size(), 1200);
    EXPECT_LT(made.positions.size(), 2000);
    ASSERT_EQ(made.colors.size(), made.positions.size());
    for (const scene::Vec3& place : made.positions) {
        const double off = std::min(std::abs(place.z - kWall),
                                    std::abs(glm::length(place - scene::Vec3(0, 0, 3)) - 1));
        EXPECT_LT(off, 1e-5) << place.x << " " << place.y << " " << place.z;
    }
    alignments[0].reset();
    alignments[2].reset();
    EXPECT_EQ(fit::dense_points(photos, alignments, 1700).positions.size(), kSide * kSide)
        << "nobody else to contradict";
}

TEST(PriorMaps, ArePackedWhereThePhotographCounts) {
    data::PosedPhoto photo = photo_from(0, 1, 0);
    fit::PriorCounts counts;
    photo.pixels[0] = 0;
    photo.pixels[10 * kSide + 10] = 0;
    photo.nearness[7] = std::numeric_limits<float>::quiet_NaN();
    EXPECT_EQ(fit::packed_maps(photo, counts).size(), 2 * kSide * kSide);
    EXPECT_EQ(counts.depth, kSide * kSide - 3);
    EXPECT_EQ(counts.normal, 0);
    photo.normals.assign(kSide * kSide, 255U << 24 | 0x00807F);
    photo.normals[20 * kSide + 20] = 0;
    const auto map = fit::packed_maps(photo, counts);
    EXPECT_EQ(counts.normal, (kSide - 2) * (kSide - 2) - 5 - 1);
    EXPECT_EQ(map[2 * (20 * kSide + 21) + 1], fit::kMapDepth | fit::kMapNormal | 0x00807F);
    EXPECT_EQ(map[2 * (10 * kSide + 11) + 1], fit::kMapDepth);
    EXPECT_EQ(map[2 * (10 * kSide + 10) + 1], 0);
    photo.nearness.clear();
    photo.normals.clear();
    EXPECT_TRUE(fit::packed_maps(photo, counts).empty());
}

}  // namespace
}  // namespace splat::test
