#include "scene/transform.h"

#include <gtest/gtest.h>

#include <limits>

#include "io/sample_scene.h"
#include "scene/frame.h"
#include "scene/sh.h"
#include "support/expect_status.h"

namespace splat::scene {
namespace {

using test::sample_scene;

constexpr Vec3 kDirections[] = {{0, 0, 1}, {0.6, -0.8, 0}, {0.48, 0.6, -0.64}, {-0.6, 0.48, 0.64}};

Similarity sample_similarity() {
    return {{0.3, -1.2, 0.5, 0.9}, {1, -2, 0.5}, 2.5};
}

Mat3 matrix_of(const Quaternion& q) {
    return glm::mat3_cast(glm::normalize(q));
}

/// R S S R^T of Gaussian i.
Mat3 covariance(const Gaussians& g, std::size_t i) {
    const float* const q = &g.rotations[i * 4];
    const Mat3 r = glm::mat3_cast(Quaternion(glm::quat(q[0], q[1], q[2], q[3])));
    Mat3 squares(1);
    for (std::size_t k = 0; k < 3; ++k)
        squares[k][k] = std::exp(2 * static_cast<double>(g.log_scales[i * 3 + k]));
    return r * squares * glm::transpose(r);
}

void expect_near(const Mat3& a, const Mat3& b, double bound) {
    for (std::size_t i = 0; i < 3; ++i)
        for (std::size_t j = 0; j < 3; ++j) EXPECT_NEAR(a[i][j], b[i][j], bound) << i << " " << j;
}

/// max(0, 0.5 + sum_k sh[k] Y_k(direction)) of Gaussian i.
Vec3 sh_color(const Gaussians& g, std::size_t i, const Vec3& direction) {
    const auto basis = sh_basis(direction);
    const std::size_t count = sh_coefficients(g.sh_degree);
    Vec3 color(0.5);
    for (std::size_t k = 0; k < count; ++k)
        color += basis[k] * Vec3(glm::make_vec3(&g.sh[(i * count + k) * 3]));
    return glm::max(color, 0.0);
}

TEST(Sh, BasisIsOrthonormalUnderItsOwnTransform) {
    auto scene = sample_scene(1, 3);
    const auto before = scene.sh;
    ShTransform(Mat3(1)).apply(scene.sh.data(), 3);
    EXPECT_LT(test::max_difference(scene.sh, before), 1e-6);
}

TEST(Sh, ColoursTurnWithTheScene) {
    const Mat3 turn = matrix_of(sample_similarity().rotation);
    for (std::uint32_t degree = 0; degree <= 3; ++degree) {
        const auto before = sample_scene(20, degree);
        auto after = before;
        ASSERT_OK(transform(after, {sample_similarity().rotation, {}, 1}));
        for (std::size_t i = 0; i < before.count(); ++i)
            for (const Vec3& d : kDirections) {
                const auto expected = sh_color(before, i, d);
                const auto got = sh_color(after, i, turn * d);
                for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(got[c], expected[c], 2e-6);
            }
    }
}

TEST(Transform, MovesMeansAndCovariances) {
    const Similarity s = sample_similarity();
    const Mat3 turn = matrix_of(s.rotation);
    const auto before = sample_scene(20, 1);
    auto after = before;
    ASSERT_OK(transform(after, s));
    for (std::size_t i = 0; i < before.count(); ++i) {
        const Vec3 mean = glm::make_vec3(&before.means[i * 3]);
        const Vec3 moved = s.scale * (turn * mean) + s.translation;
        for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(after.means[i * 3 + k], moved[k], 1e-5);
        const Mat3 expected =
            s.scale * s.scale * (turn * covariance(before, i) * glm::transpose(turn));
        expect_near(covariance(after, i), expected, 1e-5 * (1 + expected[0][0] + expected[1][1]));
    }
}

TEST(Transform, InverseUndoesIt) {
    const auto before = sample_scene(20, 3);
    auto after = before;
    const Similarity there = sample_similarity();
    const Quaternion back = glm::conjugate(glm::normalize(there.rotation));
    ASSERT_OK(transform(after, there));
    ASSERT_OK(transform(
        after, {back, glm::mat3_cast(back) * there.translation / -there.scale, 1 / there.scale}));
    EXPECT_LT(test::max_difference(after.means, before.means), 2e-6);
    EXPECT_LT(test::max_difference(after.log_scales, before.log_scales), 1e-6);
    EXPECT_LT(test::max_angle(after.rotations, before.rotations), 1e-3);
    EXPECT_LT(test::max_difference(after.sh, before.sh), 1e-6);
    EXPECT_EQ(after.opacity_logits, before.opacity_logits);
}

/// Covers lengths whose squares are no double.
TEST(Transform, TakesRotationsOfAnyLength) {
    const auto before = sample_scene(5, 2);
    auto expected = before;
    ASSERT_OK(transform(expected, {{1, 2, 3, 4}, {}, 1}));
    for (const double length : {1e-300, 1e-200, 1e200, 1e307}) {
        auto scene = before;
        ASSERT_OK(transform(scene, {{length, 2 * length, 3 * length, 4 * length}, {}, 1}));
        EXPECT_LT(test::max_difference(scene.means, expected.means), 1e-6) << length;
        EXPECT_LT(test::max_angle(scene.rotations, expected.rotations), 1e-3) << length;
    }
}

TEST(Transform, RefusesInvalidSimilarities) {
    const auto before = sample_scene(2, 1);
    auto scene = before;
    EXPECT_ERROR(transform(scene, {{0, 0, 0, 0}, {}, 1}), Code::kInvalidArgument,
                 "expected finite numbers, not all 0");
    EXPECT_ERROR(transform(scene, {{1, 0, 0, 0}, {}, 0}), Code::kInvalidArgument, "scale 0");
    EXPECT_ERROR(transform(scene, {{1, 0, 0, 0}, {}, -1}), Code::kInvalidArgument, "scale -1");
    constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(transform(scene, {{1, kNan, 0, 0}, {}, 1}).ok());
    EXPECT_FALSE(transform(scene, {{1, 0, 0, 0}, {0, kNan, 0}, 1}).ok());
    EXPECT_ERROR(transform(scene, {{1, 0, 0, 0}, {}, 1e300}), Code::kInvalidArgument,
                 "move Gaussian 0 beyond float32");
    EXPECT_ERROR(transform(scene, {{1, 0, 0, 0}, {0, 1e39, 0}, 1}), Code::kInvalidArgument,
                 "translation 0, 1e+39, 0");
    test::expect_same_bits(scene, before);
}

TEST(Frame, NamesAreThoseOfTheAxes) {
    const std::pair<Frame, const char*> names[] = {
        {Frame::kRdf, "RDF"}, {Frame::kRub, "RUB"}, {Frame::kLuf, "LUF"}, {Frame::kRuf, "RUF"},
        {Frame::kLdb, "LDB"}, {Frame::kRdb, "RDB"}, {Frame::kLub, "LUB"}, {Frame::kLdf, "LDF"}};
    for (const auto& [frame, name] : names) EXPECT_STREQ(frame_name(frame), name);
}

TEST(Frame, MirrorsMeansCovariancesAndColours) {
    for (const Frame frame : {Frame::kRub, Frame::kLuf, Frame::kRuf, Frame::kLdb, Frame::kRdb,
                              Frame::kLub, Frame::kLdf}) {
        Mat3 mirror{};
        for (std::size_t k = 0; k < 3; ++k)
            mirror[k][k] = frame_name(frame)[k] == frame_name(Frame::kRdf)[k] ? 1 : -1;
        const auto before = sample_scene(5, 3);
        auto after = before;
        convert_frame(after, Frame::kRdf, frame);
        for (std::size_t i = 0; i < before.count(); ++i) {
            for (std::size_t k = 0; k < 3; ++k)
                EXPECT_EQ(after.means[i * 3 + k],
                          static_cast<float>(mirror[k][k]) * before.means[i * 3 + k]);
            expect_near(covariance(after, i), mirror * covariance(before, i) * mirror, 1e-6);
            for (const Vec3& d : kDirections)
                for (std::size_t c = 0; c < 3; ++c)
                    EXPECT_NEAR(sh_color(after, i, mirror * d)[c], sh_color(before, i, d)[c], 1e-6)
                        << frame_name(frame);
        }
        auto by_matrix = before.sh;
        const ShTransform bands(mirror);
        for (std::size_t i = 0; i < 5; ++i) bands.apply(by_matrix.data() + i * 48, 3);
        EXPECT_LT(test::max_difference(by_matrix, after.sh), 1e-6) << "two ways agree";
        convert_frame(after, frame, Frame::kRdf);
        test::expect_same_bits(after, before);
    }
}

}  // namespace
}  // namespace splat::scene
