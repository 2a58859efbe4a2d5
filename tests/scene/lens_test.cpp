#include "scene/lens.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

namespace splat::scene {
namespace {

using Parameters = std::vector<std::pair<std::string, double>>;

Lens lens_of(LensKind kind, const Parameters& parameters) {
    Lens lens{.kind = kind};
    for (const auto& [name, value] : parameters) EXPECT_TRUE(set_parameter(lens, name, value));
    return lens;
}

const std::vector<Vec2> kPlaces = {{0, 0},      {0.3, -0.2}, {-0.7, 0.45},
                                   {0.05, 0.6}, {1e-12, 0},  {-0.4, -0.4}};

void expect_distorts(const Lens& lens, const std::function<Vec2(double x, double y)>& expected) {
    for (const Vec2& place : kPlaces) {
        const Vec2 found = distort(lens, place);
        const Vec2 wanted = expected(place.x, place.y);
        EXPECT_NEAR(found.x, wanted.x, 1e-15) << place.x << " " << place.y;
        EXPECT_NEAR(found.y, wanted.y, 1e-15) << place.x << " " << place.y;
    }
}

TEST(Lens, PerspectiveModelsAreThoseOfOpenCv) {
    expect_distorts(Lens{}, [](double x, double y) { return Vec2{x, y}; });
    expect_distorts(lens_of(LensKind::kPerspective, {{"k", 0.1}}), [](double x, double y) {
        const double factor = 1 + 0.1 * (x * x + y * y);
        return Vec2{x * factor, y * factor};
    });
    const Parameters full = {{"k1", 0.1},   {"k2", -0.05}, {"p1", 0.01}, {"p2", -0.02},
                             {"k3", 0.005}, {"k4", 0.07},  {"k5", 0.02}, {"k6", -0.01}};
    expect_distorts(lens_of(LensKind::kPerspective, full), [](double x, double y) {
        const double r2 = x * x + y * y, r4 = r2 * r2, r6 = r4 * r2;
        const double factor =
            (1 + 0.1 * r2 - 0.05 * r4 + 0.005 * r6) / (1 + 0.07 * r2 + 0.02 * r4 - 0.01 * r6);
        return Vec2{x * factor + 2 * 0.01 * x * y - 0.02 * (r2 + 2 * x * x),
                    y * factor + 0.01 * (r2 + 2 * y * y) - 2 * 0.02 * x * y};
    });
    Lens eighth;
    eighth.radial[3] = 0.3;  // the coefficient of r^8
    expect_distorts(eighth, [](double x, double y) {
        const double factor = 1 + 0.3 * std::pow(x * x + y * y, 4);
        return Vec2{x * factor, y * factor};
    });
}

TEST(Lens, FisheyesDistortTheAngle) {
    const auto angle = [](double x, double y) {  // the ray at its angle from the axis
        const double r = std::hypot(x, y);
        return r == 0 ? Vec2{0, 0} : Vec2{x / r * std::atan(r), y / r * std::atan(r)};
    };
    expect_distorts(lens_of(LensKind::kFisheye, {}), angle);
    const Parameters four = {{"k1", 0.05}, {"k2", -0.02}, {"k3", 0.01}, {"k4", -0.003}};
    expect_distorts(lens_of(LensKind::kFisheye, four), [&](double x, double y) {
        const double a = std::atan(std::hypot(x, y));
        return angle(x, y) * (1 + 0.05 * std::pow(a, 2) - 0.02 * std::pow(a, 4) +
                              0.01 * std::pow(a, 6) - 0.003 * std::pow(a, 8));
    });
    Parameters prism = four;
    prism.insert(prism.end(), {{"p1", 0.01}, {"p2", -0.02}, {"sx1", 0.004}, {"sy1", -0.006}});
    expect_distorts(lens_of(LensKind::kFisheye, prism), [&](double x, double y) {
        const Vec2 uv = angle(x, y);
        const double a2 = uv.x * uv.x + uv.y * uv.y;
        const double radial =
            0.05 * a2 - 0.02 * a2 * a2 + 0.01 * a2 * a2 * a2 - 0.003 * a2 * a2 * a2 * a2;
        return Vec2{uv.x + uv.x * radial + 2 * 0.01 * uv.x * uv.y - 0.02 * (a2 + 2 * uv.x * uv.x) +
                        0.004 * a2,
                    uv.y + uv.y * radial - 2 * 0.02 * uv.x * uv.y + 0.01 * (a2 + 2 * uv.y * uv.y) -
                        0.006 * a2};
    });
}

/// Each model has a way back: a formula or the root of an increasing function.
TEST(Lens, WayBackLeadsToTheSamePlace) {
    const double omega = 0.9;
    const Lens fov = lens_of(LensKind::kFov, {{"omega", omega}});
    const Lens fisheye = lens_of(LensKind::kFisheye, {{"k1", 0.05}, {"k2", -0.02}});
    const Lens opencv =
        lens_of(LensKind::kPerspective,
                {{"k1", 0.0561}, {"k2", -0.0772}, {"p1", -0.0019}, {"p2", -0.0025}});
    for (const Vec2& place : kPlaces) {
        const Vec2 by_fov = distort(fov, place);
        const double r = glm::length(by_fov);
        const double factor = r == 0 ? 1 : std::tan(r * omega) / (2 * std::tan(omega / 2)) / r;
        EXPECT_NEAR(by_fov.x * factor, place.x, 1e-14);
        EXPECT_NEAR(by_fov.y * factor, place.y, 1e-14);

        const Vec2 by_fisheye = distort(fisheye, place);
        double low = 0, high = 1.5;
        for (int i = 0; i < 100; ++i) {
            const double a = (low + high) / 2;
            const double there = a + 0.05 * std::pow(a, 3) - 0.02 * std::pow(a, 5);
            (there < glm::length(by_fisheye) ? low : high) = a;
        }
        EXPECT_NEAR(std::tan(low), glm::length(place), 1e-13);

        const Vec2 target = distort(opencv, place);
        Vec2 back = target;  // OpenCV's iteration: remove what the lens adds there
        for (int i = 0; i < 100; ++i) back += target - distort(opencv, back);
        EXPECT_NEAR(back.x, place.x, 1e-14);
        EXPECT_NEAR(back.y, place.y, 1e-14);
    }
}

TEST(Lens, ParametersHaveNames) {
    Lens lens;
    EXPECT_TRUE(is_pinhole(lens));
    EXPECT_TRUE(is_pinhole({.kind = LensKind::kFov})) << "an angle of 0";
    EXPECT_FALSE(is_pinhole({.kind = LensKind::kFisheye})) << "angles, not tangents";
    EXPECT_FALSE(set_parameter(lens, "k7", 1));
    EXPECT_FALSE(set_parameter(lens, "", 1));
    EXPECT_TRUE(set_parameter(lens, "k4", 0.5));
    EXPECT_EQ(lens.denominator[0], 0.5);
    EXPECT_FALSE(is_pinhole(lens));
    EXPECT_EQ(lens_text(lens), "perspective k4 = 0.5");
    Lens fisheye{.kind = LensKind::kFisheye};
    EXPECT_TRUE(set_parameter(fisheye, "k4", 0.5));
    EXPECT_FALSE(set_parameter(fisheye, "k5", 0.5)) << "OpenCV's rational model is no fisheye";
    EXPECT_EQ(fisheye.radial[3], 0.5);
    EXPECT_TRUE(set_parameter(fisheye, "k1", -0.25));
    EXPECT_EQ(lens_text(fisheye), "fisheye k1 = -0.25, k4 = 0.5");
}

TEST(Lens, FoldsBackWhereItsPolynomialDoes) {
    const Lens barrel = lens_of(LensKind::kPerspective, {{"k1", -0.3}, {"p1", 0.01}});
    const double fold = 1 / std::sqrt(3 * 0.3);  // where r - 0.3 r^3 is largest
    EXPECT_NEAR(unfolded_radius(barrel, 2), fold, 2e-3);
    EXPECT_EQ(unfolded_radius(barrel, 1), 1);
    EXPECT_EQ(unfolded_radius({.kind = LensKind::kFisheye}, 50), 50);
    const Lens pole = lens_of(LensKind::kPerspective, {{"k4", -1}});
    EXPECT_NEAR(unfolded_radius(pole, 4), 1, 4e-3) << "beyond the pole all is turned";
}

}  // namespace
}  // namespace splat::scene
