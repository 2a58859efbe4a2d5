#include "synthetic/solid.h"

#include <gtest/gtest.h>

#include "synthetic/object.h"

namespace splat::synthetic {
namespace {

using glm::dot;

constexpr Vec3 kColor = {1, 0, 0};

Ray towards(const Vec3& origin, const Vec3& target) {
    return {origin, target - origin};
}

TEST(Solid, BoxIsEnteredAtItsFaces) {
    const Solid box = make_box({-1, -2, -3}, {1, 2, 3}, kColor);
    for (std::size_t axis = 0; axis < 3; ++axis)
        for (const double sign : {-1.0, 1.0}) {
            Ray ray;
            ray.origin[axis] = 10 * sign;
            ray.direction[axis] = -2 * sign;
            const auto hit = enter(box, ray);
            ASSERT_TRUE(hit);
            EXPECT_DOUBLE_EQ(hit->distance, (10 - static_cast<double>(axis + 1)) / 2);
            for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(hit->normal[i], i == axis ? sign : 0);
        }
    EXPECT_FALSE(enter(box, {{10, 2.001, 0}, {-1, 0, 0}})) << "next to it";
    EXPECT_FALSE(enter(box, {{10, 0, 0}, {1, 0, 0}})) << "behind the ray";
    EXPECT_FALSE(enter(box, {{0, 0, 0}, {1, 0, 0}})) << "from inside";
    EXPECT_FALSE(enter(box, {{1.5, 0, 0}, {0, 1, 0}})) << "along a face";
}

TEST(Solid, BevelCutsTheEdgesOff) {
    const Solid box = make_box({-1, -1, -1}, {1, 1, 1}, kColor, 0.2);
    const auto hit = enter(box, towards({3, 3, 0}, {0, 0, 0}));
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->normal[0], std::sqrt(0.5), 1e-12);
    EXPECT_NEAR(3 - 3 * hit->distance, 0.9, 1e-12) << "half way between the corner and both bevels";
    EXPECT_FALSE(enter(box, {{5, 0.95, 0.95}, {-1, 0, 0}}));
    EXPECT_TRUE(enter(box, {{5, 0.9, 0.9}, {-1, 0, 0}}));
}

TEST(Solid, FrustumHasSlantedSides) {
    const Solid frustum = make_frustum({-2, -2, 0}, {2, 2, 2}, {-1, -1, 0}, {1, 1, 0}, kColor);
    const auto hit = enter(frustum, {{9, 0, 1}, {-1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(9 - hit->distance, 1.5, 1e-12);
    EXPECT_NEAR(hit->normal[0], 2 / std::sqrt(5.0), 1e-12);
    EXPECT_NEAR(hit->normal[2], 1 / std::sqrt(5.0), 1e-12);
    EXPECT_NEAR(support(frustum, {1, 0, 0}), 2, 1e-12);
    EXPECT_NEAR(reach(frustum, {0, 0, 0}), std::sqrt(8.0), 1e-12);
}

TEST(Solid, CylinderHasMantleAndCaps) {
    const Solid rod = make_cylinder({0, -2, 0}, {0, 2, 0}, 0.5, kColor);
    auto hit = enter(rod, {{5, 1, 0.3}, {-1, 0, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(5 - hit->distance, 0.4, 1e-12);
    EXPECT_NEAR(hit->normal[0], 0.8, 1e-12);
    EXPECT_NEAR(hit->normal[2], 0.6, 1e-12);
    hit = enter(rod, {{0.3, 5, 0.3}, {0, -1, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(hit->distance, 3, 1e-12);
    EXPECT_NEAR(hit->normal[1], 1, 1e-12);
    EXPECT_FALSE(enter(rod, {{0.4, 5, 0.4}, {0, -1, 0}})) << "next to the cap";
    EXPECT_FALSE(enter(rod, {{5, 2.01, 0}, {-1, 0, 0}})) << "above the cap";
    Solid half = rod;
    cut(half, {0, 0, 0}, {0, 0, 1});
    EXPECT_FALSE(enter(half, {{5, 0, 0.1}, {-1, 0, 0}}));
    EXPECT_TRUE(enter(half, {{5, 0, -0.1}, {-1, 0, 0}}));
}

TEST(Solid, EllipsoidIsExact) {
    const Solid ball = make_ellipsoid({1, 0, 0}, {1, 2, 3}, kColor);
    const auto hit = enter(ball, {{1 + 0.5, 10, 0}, {0, -1, 0}});
    ASSERT_TRUE(hit);
    EXPECT_NEAR(10 - hit->distance, 2 * std::sqrt(0.75), 1e-12);
    EXPECT_NEAR(glm::length(hit->normal), 1, 1e-12);
    EXPECT_NEAR(hit->normal[0] / hit->normal[1], 0.5 / (2 * std::sqrt(0.75) / 4), 1e-12);
    EXPECT_NEAR(support(ball, {0, 0, 1}), 3, 1e-12);
}

/// Every kind of solid, turned: the point of entry lies on it, and rays from outside along the normal
/// come back to it.
TEST(Solid, MovesAndTurnsWithItsHull) {
    Random random(1, 2, 3, 4);
    const Solid solids[] = {make_box({-1, -2, -3}, {1, 2, 3}, kColor, 0.1),
                            make_cylinder({0, 0, -1}, {0.5, 0, 1}, 0.7, kColor),
                            make_ellipsoid({0, 0, 0}, {1, 0.5, 2}, kColor)};
    for (const Solid& solid : solids) {
        const Vec3 about = {0.3, -0.2, 0.7};
        const Vec3 center = {1, 2, 3};
        Solid other = moved(turned(solid, turn_about(2, 0.4), about), center, 2.5);
        find_hull(other);
        const auto there = [&](const Vec3& p) {
            return (turn_about(2, 0.4) * (p - about) + about - center) * 2.5;
        };
        int hits = 0;
        for (int i = 0; i < 200; ++i) {
            const Vec3 from = {random.between(-5, 5), random.between(-5, 5), 6};
            const Vec3 to = {random.between(-1, 1), random.between(-1, 1), 0};
            const auto a = enter(solid, towards(from, to));
            const auto b = enter(other, towards(there(from), there(to)));
            ASSERT_EQ(a.has_value(), b.has_value());
            if (!a) continue;
            ++hits;
            EXPECT_NEAR(a->distance, b->distance, 1e-9);
            const Vec3 turned_normal = turn_about(2, 0.4) * a->normal;
            EXPECT_NEAR(dot(turned_normal, b->normal), 1, 1e-9);
            const Ray ray = towards(there(from), there(to));
            for (const Vec3& axis : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{0, 0, 1}, Vec3{-1, 0, 0}}) {
                double most = -1e9;
                for (const Vec3& p : other.hull) most = std::max(most, dot(p, axis));
                EXPECT_LE(dot(ray.origin, axis) + b->distance * dot(ray.direction, axis),
                          most + 1e-9);
            }
        }
        EXPECT_GT(hits, 50);
    }
}

}  // namespace
}  // namespace splat::synthetic
