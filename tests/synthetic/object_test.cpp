#include "synthetic/object.h"

#include <gtest/gtest.h>

namespace splat::synthetic {
namespace {

TEST(Object, FitsInTheBall) {
    for (std::uint32_t i = 0; i < 60; ++i) {
        Random random(9, 0, i, 0);
        const Solids solids = fitted(i % 2 == 0 ? make_car(random) : make_chair(random));
        EXPECT_GT(solids.size(), 5U);
        double most = 0;
        for (const Solid& solid : solids) {
            most = std::max(most, reach(solid, {0, 0, 0}));
            EXPECT_EQ(glm::clamp(solid.color, 0.0, 1.0), solid.color);
        }
        EXPECT_NEAR(most, 0.5, 1e-9) << i;
    }
}

TEST(Object, ColorsAreThoseOfTheHue) {
    EXPECT_EQ(hsv({0, 1, 1}), (Vec3{1, 0, 0}));
    EXPECT_EQ(hsv({0.5, 1, 0.5}), (Vec3{0, 0.5, 0.5}));
    EXPECT_EQ(hsv({0.7, 0, 0.25}), (Vec3{0.25, 0.25, 0.25}));
}

}  // namespace
}  // namespace splat::synthetic
