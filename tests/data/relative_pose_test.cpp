#include "data/relative_pose.h"

#include <gtest/gtest.h>

#include "data/folder.h"
#include "data/resample.h"
#include "scene/camera_pose.h"
#include "support/expect_status.h"
#include "support/golden_file.h"
#include "synthetic/object.h"

namespace splat::data {
namespace {

using scene::kNoPose;
using scene::make_pose;
using scene::Mat3;
using scene::Mat4;
using scene::Vec3;
using synthetic::turn_about;

TEST(Folder, InverseOfAPoseRoundedToFloatsGoesBack) {
    Mat4 rounded = make_pose(turn_about(0, 0.3) * turn_about(2, 1.1), {100, 50, 7});
    for (double& number : rounded) number = static_cast<double>(static_cast<float>(number));
    const auto back = need(inverse_pose(need(inverse_pose(rounded))));
    for (std::size_t i = 0; i < 16; ++i) EXPECT_NEAR(back[i], rounded[i], 1e-12) << i;
}

TEST(RelativePose, FirstIsExactlyTheIdentity) {
    const Mat4 odd = make_pose(turn_about(0, 0.3) * turn_about(2, 1.1), {0.7, -5, 3});
    const Mat4 poses[] = {odd, make_pose(turn_about(1, 2), {1, 2, 3}), odd};
    const auto views = need(relative_views(poses));
    for (const std::size_t i : {0U, 2U}) {
        for (std::size_t k = 0; k < 16; ++k)
            EXPECT_EQ(views[i].view_to_world[k], static_cast<float>(kNoPose[k]));
        EXPECT_EQ(views[i].quaternion, (std::array<float, 4>{1, 0, 0, 0}));
    }
    EXPECT_NE(views[1].quaternion[0], 1);
    EXPECT_TRUE(relative_views({}).value().empty());
}

/// A point seen by camera i at p lies at p M in the frame of the first camera.
TEST(RelativePose, MapsPointsBetweenTheCameras) {
    const Mat4 poses[] = {make_pose(turn_about(0, 0.3) * turn_about(2, 1.1), {0.7, -5, 3}),
                          make_pose(turn_about(1, 2) * turn_about(0, -1), {1, 2, 3})};
    const auto views = need(relative_views(poses));
    const double p[] = {0.2, -0.4, 1.5, 1};
    double q[4] = {};
    for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i)
            q[j] += p[i] * static_cast<double>(views[1].view_to_world[i * 4 + j]);
    for (std::size_t i = 0; i < 3; ++i) {
        double there = 0;
        double here = 0;
        for (std::size_t k = 0; k < 4; ++k) {
            there += poses[1][i * 4 + k] * p[k];
            here += poses[0][i * 4 + k] * q[k];
        }
        EXPECT_NEAR(there, here, 1e-6) << "float32 entries of size up to 8";
    }
}

TEST(RelativePose, QuaternionsTurnAsTheirMatrix) {
    Random random(1, 1, 1, 1);
    for (int i = 0; i < 300; ++i) {
        // Angles near 180 degrees too, where the trace carries no information.
        const double angle = i % 3 == 0 ? 3.14159265358979 - 1e-9 * i : random.between(-3.1, 3.1);
        const double z = random.between(-3, 3), y = random.between(-1.5, 1.5);
        const Mat3 turn = turn_about(2, z) * turn_about(1, y);
        const Mat3 r = turn * (i % 2 == 0 ? turn_about(0, angle) : turn_about(2, angle)) *
                       glm::transpose(turn);
        const scene::Quaternion q = quaternion_of(r);
        EXPECT_GE(q[0], 0);
        const Mat3 back = glm::mat3_cast(q);
        for (std::size_t a = 0; a < 3; ++a)
            for (std::size_t b = 0; b < 3; ++b) EXPECT_NEAR(back[a][b], r[a][b], 1e-12) << angle;
    }
}

TEST(RelativePose, OriginDistanceIsAlongTheAxis) {
    // At (3, 7, -2), looking along +z, which is where the origin is 2 ahead.
    EXPECT_EQ(origin_distance(make_pose(turn_about(0, 0), {3, 7, -2})), 2);
    EXPECT_NEAR(origin_distance(make_pose(turn_about(1, std::acos(-1.0)), {3, 7, -2})), -2, 1e-12);
}

TEST(RelativePose, RefusesPosesWithoutInverse) {
    Mat4 bad = kNoPose;
    bad[5] = std::numeric_limits<double>::quiet_NaN();
    Mat4 flat = kNoPose;
    flat[10] = 0;
    for (const Mat4& pose : {bad, flat}) {
        const Mat4 first[] = {pose, kNoPose};
        const Mat4 second[] = {kNoPose, pose};
        EXPECT_ERROR(relative_views(first), Code::kFormat, "singular");
        EXPECT_ERROR(relative_views(second), Code::kFormat, "singular");
    }
}

class GoldenNetCameras : public testing::Test {
  protected:
    void SetUp() override { SPLAT_NEEDS_GOLDEN_FOLDER(); }
};

/// 3e-6: the reference inverts and multiplies in float32, some ten roundings of 6e-8 of values up
/// to 4.
constexpr double kPoseTolerance = 3e-6;

TEST_F(GoldenNetCameras, PosesAndQuaternionsAreTheReferences) {
    test::each_case(
        "cams", "abs_vw", {"srn", "co3d", "nmr", "obj"},
        [&](const test::Golden& golden, const std::string& set) {
            const std::vector<double> rows = golden.doubles(set + ".abs_vw");
            std::vector<Mat4> poses(rows.size() / 16);
            for (std::size_t i = 0; i < rows.size(); ++i)  // stored transposed
                poses[i / 16][(i % 4) * 4 + i / 4 % 4] = rows[i];
            const auto views = need(relative_views(poses));
            const std::vector<double> expected = golden.doubles(set + ".rel_vw");
            const std::vector<double> quaternions = golden.doubles(set + ".rel_quat");
            for (std::size_t i = 0; i < poses.size(); ++i) {
                const RelativeView& view = views[i];
                for (std::size_t k = 0; k < 16; ++k)
                    EXPECT_NEAR(view.view_to_world[k], expected[i * 16 + k], kPoseTolerance)
                        << set << i;
                // The reference divides by 4 w, and w comes from 1 + trace with an error of 1e-7.
                const double w = quaternions[i * 4];
                for (std::size_t k = 0; k < 4; ++k)
                    EXPECT_NEAR(view.quaternion[k], quaternions[i * 4 + k],
                                kPoseTolerance / std::max(w * w, 0.01))
                        << set << i;
            }
        });
}

TEST_F(GoldenNetCameras, QuaternionsOfMatricesAreTheReferences) {
    test::each_golden("cams", [&](const test::Golden& golden) {
        const std::vector<double> m = golden.doubles("q.M");
        const std::vector<double> expected = golden.doubles("q.q");
        for (std::size_t i = 0; i < m.size() / 9; ++i) {
            const scene::Quaternion q =
                quaternion_of(glm::transpose(glm::make_mat3(m.data() + i * 9)));
            const double w = expected[i * 4];
            for (std::size_t k = 0; k < 4; ++k)
                EXPECT_NEAR(q[k], expected[i * 4 + k], kPoseTolerance / std::max(w * w, 0.01)) << i;
        }
    });
}

TEST_F(GoldenNetCameras, ImagesAreResizedAsPillowDoes) {
    test::each_golden("cams", [&](const test::Golden& golden) {
        std::vector<std::string> numbers;
        while (golden.has("srn.img" + std::to_string(numbers.size())))
            numbers.push_back(std::to_string(numbers.size()));
        golden.expect_cases(numbers, {"0", "1"});
        for (const std::string& number : numbers) {
            const std::string name = "srn.img" + number;
            const std::vector<std::int64_t> samples = golden.array(name).ints().value();
            const std::uint32_t channels = golden.dim(name, 2);
            io::Image image{golden.dim(name, 1), golden.dim(name, 0), channels, 8, {}};
            image.samples.assign(samples.begin(), samples.end());
            const std::string resized = "srn.half" + number;
            const auto half = need(
                resample(image, golden.dim(resized, 2), golden.dim(resized, 1), Filter::kBicubic));
            const std::vector<double> expected = golden.doubles("srn.half" + number);
            const std::size_t area = expected.size() / 3;
            for (std::size_t i = 0; i < area; ++i)
                for (std::size_t c = 0; c < 3; ++c)
                    EXPECT_EQ(half.samples[i * channels + c],
                              std::lround(255 * expected[c * area + i]))
                        << number;
        }
    });
}

}  // namespace
}  // namespace splat::data
