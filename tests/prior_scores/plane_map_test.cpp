#include "prior_scores/plane_map.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "prior_scores/plane_scores.h"
#include "prior_scores/room.h"
#include "support/expect_status.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using prior_scores::compare_planes;
using prior_scores::find_planes;
using prior_scores::PlaneMap;
using prior_scores::PlaneRules;
using scene::Vec3;

constexpr std::uint32_t kWidth = 160, kHeight = 120;

/// The truth leaves out planes of less than 1% of the pixels.
Room sample(double yaw = 0.3, double pitch = -0.1) {
    Room made = room(kWidth, kHeight, 1.4, yaw, pitch);
    std::map<std::array<float, 4>, int> pixels;
    const auto at = [&](std::size_t i) {
        const float* const n = &made.planes[i];
        return std::array{n[0], n[1], n[2], n[3]};
    };
    for (std::size_t i = 0; i < made.planes.size(); i += 4) ++pixels[at(i)];
    for (std::size_t i = 0; i < made.planes.size(); i += 4)
        if (pixels[at(i)] * 100 < int{kWidth * kHeight}) std::fill_n(&made.planes[i], 4, 0.0F);
    return made;
}

/// [height, width, 4] of the planes.
std::vector<float> numbers_of(const PlaneMap& map) {
    std::vector<float> numbers;
    for (const std::uint32_t id : map.ids) {
        const prior_scores::FoundPlane plane =
            id == 0 ? prior_scores::FoundPlane{} : map.planes[id - 1];
        for (std::size_t k = 0; k < 3; ++k) numbers.push_back(static_cast<float>(plane.normal[k]));
        numbers.push_back(static_cast<float>(plane.distance));
    }
    return numbers;
}

/// Turns normals and moves depths by errors of a standard deviation: radians, shares of the depth.
void add_noise(Room& seen, double radians, double share) {
    Rng rng(7);
    for (float& n : seen.normals) n += static_cast<float>(radians * rng.normal());
    for (float& z : seen.depth) z *= static_cast<float>(1 + share * rng.normal());
}

TEST(PlaneMap, ARoomIsItsWalls) {
    for (const double yaw : {0.0, 0.3, -0.5, 0.9})
        for (const double pitch : {0.0, 0.4, -0.2}) {
            const Room seen = sample(yaw, pitch);
            const PlaneMap map = need(find_planes(seen.depth, seen.normals, seen.camera));
            const auto scores = need(compare_planes(numbers_of(map), seen.planes, 1e-4, 0.01));
            EXPECT_GT(scores.covering, 0.995) << yaw << " " << pitch;
            EXPECT_EQ(scores.recall, 1) << yaw << " " << pitch;
        }
}

TEST(PlaneMap, NoiseMovesNoPlaneByFiveCentimetres) {
    Room seen = sample();
    add_noise(seen, 0.05, 0.003);
    PlaneRules rules;
    rules.least = 0.01;
    const PlaneMap map = need(find_planes(seen.depth, seen.normals, seen.camera, rules));
    const auto scores = need(compare_planes(numbers_of(map), seen.planes, 0.05, 10));
    EXPECT_GT(scores.covering, 0.95);
    EXPECT_EQ(scores.recall, 1);
    EXPECT_EQ(scores.precision, 1);
}

TEST(PlaneMap, IdsAreInOrderOfSizeAndEveryPixelOfAPlaneLiesOnIt) {
    const Room seen = sample();
    const PlaneRules rules;
    const PlaneMap map = need(find_planes(seen.depth, seen.normals, seen.camera, rules));
    std::vector<std::uint64_t> counts(map.planes.size() + 1, 0);
    for (std::size_t i = 0; i < map.ids.size(); ++i) {
        ASSERT_LE(map.ids[i], map.planes.size());
        ++counts[map.ids[i]];
        if (map.ids[i] == 0) continue;
        const auto z = static_cast<double>(seen.depth[i]);
        const Vec3 point =
            z * Vec3((static_cast<double>(i % kWidth) + 0.5 - seen.camera.cx) / seen.camera.fx,
                     (static_cast<double>(i / kWidth) + 0.5 - seen.camera.cy) / seen.camera.fy, 1);
        const prior_scores::FoundPlane& plane = map.planes[map.ids[i] - 1];
        EXPECT_LE(std::abs(glm::dot(plane.normal, point) + plane.distance), rules.offset * z);
    }
    for (std::size_t k = 0; k < map.planes.size(); ++k) {
        EXPECT_EQ(map.planes[k].pixels, counts[k + 1]);
        EXPECT_NEAR(glm::length(map.planes[k].normal), 1, 1e-12);
        EXPECT_GT(map.planes[k].distance, 0);
        EXPECT_GE(map.planes[k > 0 ? k - 1 : k].pixels, map.planes[k].pixels);
    }
    EXPECT_EQ(need(find_planes(seen.depth, seen.normals, seen.camera, rules)).ids, map.ids);
}

TEST(PlaneMap, AWallBehindAPillarIsOnePlane) {
    const auto camera = need(scene::camera_from_fov(60, 40, 1.0));
    std::vector<float> depth(60 * 40, 3), normals;
    for (std::size_t i = 0; i < depth.size(); ++i) {
        if (i % 60 >= 25 && i % 60 < 35) depth[i] = 2;
        normals.insert(normals.end(), {0, 0, 1});  // away from the camera: its sign does not matter
    }
    const PlaneMap map = need(find_planes(depth, normals, camera));
    ASSERT_EQ(map.planes.size(), 2U);
    EXPECT_EQ(map.planes[0].pixels, 2000U);
    EXPECT_NEAR(map.planes[0].distance, 3, 1e-12);
    EXPECT_NEAR(map.planes[0].normal.z, -1, 1e-12);
    EXPECT_EQ(map.ids.front(), map.ids.back());
    EXPECT_EQ(map.planes[1].pixels, 400U);
}

TEST(PlaneMap, ASphereAndNothingAreNoPlane) {
    const auto camera = need(scene::camera_from_fov(80, 80, 0.8));
    std::vector<float> depth, normals;
    for (int i = 0; i < 80 * 80; ++i) {
        const Vec3 ray((i % 80 + 0.5 - camera.cx) / camera.fx,
                       (static_cast<double>(i / 80) + 0.5 - camera.cy) / camera.fy, 1);
        // |t ray - (0, 0, 4)| = 1
        const double a = glm::dot(ray, ray), b = 4, c = 15, root = b * b - a * c;
        const double t = root < 0 ? 0 : (b - std::sqrt(root)) / a;
        const Vec3 n = t > 0 ? t * ray - Vec3(0, 0, 4) : Vec3{};
        depth.push_back(static_cast<float>(t));
        for (std::size_t k = 0; k < 3; ++k) normals.push_back(static_cast<float>(n[k]));
    }
    PlaneRules rules;
    rules.offset = 0.002;
    rules.least = 0.05;
    EXPECT_TRUE(need(find_planes(depth, normals, camera, rules)).planes.empty());
    const std::vector<float> none(depth.size(), 0);
    EXPECT_TRUE(need(find_planes(none, normals, camera)).planes.empty());
    const std::vector<float> no_normals(normals.size(), 0);
    EXPECT_TRUE(need(find_planes(depth, no_normals, camera)).planes.empty());
}

TEST(PlaneMap, RefusesWhatIsNoMapAndRulesOutOfRange) {
    const Room seen = sample();
    auto depth = seen.depth;
    EXPECT_ERROR(find_planes({}, seen.normals, seen.camera), Code::kShape, "the depth has 0");
    EXPECT_ERROR(find_planes(depth, depth, seen.camera), Code::kShape, "expected 57600");
    depth[5] = std::numeric_limits<float>::infinity();
    EXPECT_ERROR(find_planes(depth, seen.normals, seen.camera), Code::kInvalidArgument,
                 "inf at number 5");
    const std::pair<double PlaneRules::*, const char*> rules[] = {{&PlaneRules::degrees, "angle"},
                                                                  {&PlaneRules::offset, "offset"},
                                                                  {&PlaneRules::least, "share"}};
    for (const auto& [member, name] : rules)
        for (const double value : {0.0, -1.0, 91.0, std::nan("")}) {
            PlaneRules wrong;
            wrong.*member = value;
            EXPECT_ERROR(find_planes(seen.depth, seen.normals, seen.camera, wrong),
                         Code::kInvalidArgument, name);
        }
}

}  // namespace
}  // namespace splat::test
