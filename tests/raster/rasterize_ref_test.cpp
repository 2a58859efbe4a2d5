// The reference's gradients against central differences of its own forward pass, every mode, and its boxes of rays.
#include "ref/rasterize_ref.h"

#include <gtest/gtest.h>

#include "raster/fragile.h"
#include "raster/raster_outputs.h"
#include "raster/raster_scenes.h"
#include "support/gradcheck.h"
#include "support/rng_fill.h"

namespace splat::test {
namespace {

using Scene = ref::RasterScene<double>;

/// A scene, weights of a loss on rgb, alpha and depth, and the gradient of that loss.
struct Graded {
    Scene scene;
    ref::RasterLoss<double> loss;
    RasterGradients gradients;

    Graded(const RasterCase& from, const RasterMode& mode)
        : Graded(reference_scene<double>(from, mode)) {}
    explicit Graded(Scene given) : scene(std::move(given)) {
        const std::vector<bool> fragile = fragile_pixels(scene);
        loss.grad_rgb = to_double(loss_weights(fragile, 3, 21));
        loss.grad_alpha = to_double(loss_weights(fragile, 1, 22));
        loss.grad_depth = to_double(loss_weights(fragile, 1, 23));
        gradients = reference_gradients(scene, loss);
    }

    [[nodiscard]] double value(const Scene& at) const {
        const ref::BlendForward<double> out = ref::rasterize_forward(at);
        return dot(out.rgb, loss.grad_rgb) + dot(out.alpha, loss.grad_alpha) +
               dot(out.depth, loss.grad_depth);
    }

    /// Central differences with respect to one tensor of the scene.
    [[nodiscard]] testing::AssertionResult check(const char* name,
                                                 std::vector<double> Scene::*tensor,
                                                 const std::vector<double>& gradient) const {
        Scene moved = scene;
        const auto at = [&](const std::vector<double>& x) {
            moved.*tensor = x;
            return value(moved);
        };
        return gradcheck(name, at, scene.*tensor, gradient);
    }

    void expect_all(const std::string& what) const {
        SCOPED_TRACE(what);
        EXPECT_TRUE(check("means", &Scene::means, gradients.means));
        EXPECT_TRUE(check("scales", &Scene::scales, gradients.scales));
        EXPECT_TRUE(check("rotations", &Scene::rotations, gradients.rotations));
        EXPECT_TRUE(check("opacities", &Scene::opacities, gradients.opacities));
        EXPECT_TRUE(scene.colors.empty() ? check("sh", &Scene::sh, gradients.sh)
                                         : check("colors", &Scene::colors, gradients.colors));
    }
};

std::vector<RasterCase> small_cases() {
    RasterCase offcentre = random_scene({14, 21, 17}, 34, 2);
    offcentre.camera.cx *= 0.7F;
    offcentre.camera.fy *= 1.3F;
    RasterCase colored = random_scene({10, 17, 20}, 35, 0);
    colored.colors = colored.sh;
    colored.sh.clear();
    return {random_scene({12, 20, 18}, 31, 3), wide_scene({10, 18, 18}, 33),
            opaque_scene({8, 17, 16}, 36), offcentre, colored};
}

TEST(RasterConstants, AreTheirFloat32Values) {
    EXPECT_EQ(raster::kAlphaMin, 1.0F / 255.0F);
    EXPECT_EQ(raster::kTransmittanceMin, static_cast<float>(1e-4));
    // Two saturated Gaussians stop a pixel before the second, in float32 and in the reference.
    const double behind = 1 - static_cast<double>(raster::kAlphaMax);
    EXPECT_LT(behind * behind, static_cast<double>(raster::kTransmittanceMin));
    EXPECT_LT((1 - raster::kAlphaMax) * (1 - raster::kAlphaMax), raster::kTransmittanceMin);
}

TEST(RasterizeReference, GradcheckFloat64) {
    for (const RasterCase& scene : small_cases())
        for (const RasterMode& mode : kRasterModes)
            Graded(scene, mode).expect_all(scene.name + " " + mode.name);
}

TEST(RasterizeReference, GradcheckByDistanceAndCut) {
    for (const RasterCase& scene :
         {random_scene({12, 20, 18}, 31, 3), wide_scene({10, 18, 18}, 33)})
        for (const RasterMode& mode : kDrawnModes)
            Graded(scene, mode).expect_all(scene.name + " " + mode.name);
}

/// Rotations of any length: gsplat normalises them, 3dgs uses the matrix unchanged.
TEST(RasterizeReference, GradcheckRotationsOfAnyLength) {
    RasterCase scene = random_scene({12, 20, 18}, 37, 1);
    for (std::size_t i = 0; i < scene.rotations.size(); ++i)
        scene.rotations[i] *= 0.8F + 0.1F * static_cast<float>(i / 4 % 5);
    for (const RasterMode& mode : kRasterModes) Graded(scene, mode).expect_all(mode.name);
}

/// All 16 entries of world_to_camera; the centre of the camera follows the inverse of the whole
/// matrix, whose last row CameraFrame takes as 0 0 0 1 and only its gradient knows.
TEST(RasterizeReference, GradcheckCamera) {
    for (const RasterMode& mode : kRasterModes) {
        const Graded graded(random_scene({14, 20, 18}, 38, 3), mode);
        Scene moved = graded.scene;
        const auto at = [&](const std::vector<double>& x) {
            std::copy_n(x.begin(), 12, moved.camera.world_to_camera.begin());
            return graded.value(moved);
        };
        const auto& matrix = graded.scene.camera.world_to_camera;
        const auto& gradient = graded.gradients.world_to_camera;
        EXPECT_TRUE(gradcheck("world_to_camera", at, {matrix.begin(), matrix.begin() + 12},
                              {gradient.begin(), gradient.begin() + 12}))
            << mode.name;
    }
}

/// The limits of x / z move with them: wide_scene has Gaussians there.
TEST(RasterizeReference, GradcheckIntrinsics) {
    for (const RasterMode& mode : kRasterModes)
        for (const RasterCase& from :
             {random_scene({14, 20, 18}, 38, 3), wide_scene({10, 18, 18}, 33)}) {
            const Graded graded(from, mode);
            const auto& camera = graded.scene.camera;
            const auto at = [&](const std::vector<double>& x) {
                Scene moved = graded.scene;
                moved.camera.fx = x[0];
                moved.camera.fy = x[1];
                moved.camera.cx = x[2];
                moved.camera.cy = x[3];
                return graded.value(moved);
            };
            EXPECT_TRUE(gradcheck("intrinsics", at, {camera.fx, camera.fy, camera.cx, camera.cy},
                                  graded.gradients.intrinsics))
                << from.name << " " << mode.name;
        }
}

TEST(RasterizeReference, GradcheckTwist) {
    for (const RasterMode& mode : kRasterModes) {
        const Graded graded(random_scene({14, 20, 18}, 39, 2), mode);
        const auto& matrix = graded.scene.camera.world_to_camera;
        const auto at = [&](const std::vector<double>& twist) {
            Scene moved = graded.scene;
            for (std::size_t c = 0; c < 4; ++c) {
                const ref::Vec3<double> column{matrix[c], matrix[4 + c], matrix[8 + c]};
                const auto turned =
                    ref::cross(ref::Vec3<double>{twist[3], twist[4], twist[5]}, column);
                for (std::size_t r = 0; r < 3; ++r)
                    moved.camera.world_to_camera[4 * r + c] += turned[r] + (c == 3 ? twist[r] : 0);
            }
            return graded.value(moved);
        };
        EXPECT_TRUE(gradcheck("twist", at, std::vector<double>(6), graded.gradients.twist))
            << mode.name;
    }
}

/// Intermediate gradients, by moving the inputs of blending.
TEST(RasterizeReference, GradcheckMeans2dAndConics) {
    for (const RasterMode& mode : kRasterModes) {
        const Graded graded(random_scene({14, 20, 18}, 40, 1), mode);
        const ref::ProjectForward<double> projected = ref::project_forward(graded.scene);
        const auto loss_of = [&](const ref::ProjectForward<double>& moved) {
            const auto out = ref::blend_forward(graded.scene, moved);
            return dot(out.rgb, graded.loss.grad_rgb) + dot(out.alpha, graded.loss.grad_alpha) +
                   dot(out.depth, graded.loss.grad_depth);
        };
        const RasterOutputs outputs = reference_outputs(graded.scene);
        const auto at_means2d = [&](const std::vector<double>& x) {
            ref::ProjectForward<double> moved = projected;
            for (std::size_t i = 0; i < x.size(); ++i) moved.gaussians[i / 2].mean2d[i % 2] = x[i];
            return loss_of(moved);
        };
        EXPECT_TRUE(gradcheck("means2d", at_means2d, outputs.means2d, graded.gradients.means2d));
        const auto at_conics = [&](const std::vector<double>& x) {
            ref::ProjectForward<double> moved = projected;
            for (std::size_t i = 0; i < x.size(); ++i) moved.gaussians[i / 3].conic[i % 3] = x[i];
            return loss_of(moved);
        };
        EXPECT_TRUE(gradcheck("conics", at_conics, outputs.conics, graded.gradients.conics));
    }
}

/// The original gradient is the true one unless alpha is clamped, a mean is outside the field of
/// view or a determinant is small. Each quirk shows only where its cause is present.
TEST(RasterizeReference, OriginalGradientDiffersOnlyByItsQuirks) {
    const RasterMode& mode = kRasterModes[0];
    const auto difference = [&](const RasterCase& from) {
        const Graded graded(from, mode);
        Scene original = graded.scene;
        original.options.gradient = ref::RasterGradient::kOriginal;
        const RasterGradients other = reference_gradients(original, graded.loss);
        double worst = 0;
        double largest = 0;
        for (std::size_t i = 0; i < other.means.size(); ++i) {
            worst = std::max(worst, std::abs(other.means[i] - graded.gradients.means[i]));
            largest = std::max(largest, std::abs(graded.gradients.means[i]));
        }
        return worst / largest;
    };
    RasterCase calm = random_scene({20, 24, 20}, 41, 1);
    for (float& opacity : calm.opacities) opacity *= 0.9F;
    EXPECT_LT(difference(calm), 1e-5);  // 1e-7 / det^2, and det >= 0.09
    EXPECT_GT(difference(opaque_scene({20, 24, 20}, 42)), 1e-3);
    EXPECT_GT(difference(wide_scene({20, 24, 20}, 43)), 1e-3);
}

/// Sums of absolute values bound the sums, and are equal for a single pixel.
TEST(RasterizeReference, AbsoluteGradientsOfMeans2d) {
    const Graded graded(random_scene({20, 24, 20}, 44, 0), kRasterModes[1]);
    const RasterGradients& g = graded.gradients;
    double plain = 0;
    double absolute = 0;
    for (std::size_t i = 0; i < g.means2d.size(); ++i) {
        EXPECT_LE(std::abs(g.means2d[i]), g.means2d_abs[i] * (1 + 1e-12));
        plain += std::abs(g.means2d[i]);
        absolute += g.means2d_abs[i];
    }
    EXPECT_GT(absolute, 1.5 * plain) << "terms of both signs";
    Graded pixel = graded;
    for (std::vector<double>* weights :
         {&pixel.loss.grad_rgb, &pixel.loss.grad_alpha, &pixel.loss.grad_depth}) {
        const std::size_t channels = weights->size() / pixel.scene.pixels();
        for (std::size_t i = 0; i < weights->size(); ++i)
            if (i / channels != pixel.scene.pixels() / 2) (*weights)[i] = 0;
    }
    const RasterGradients one = reference_gradients(pixel.scene, pixel.loss);
    for (std::size_t i = 0; i < one.means2d.size(); ++i)
        EXPECT_DOUBLE_EQ(std::abs(one.means2d[i]), one.means2d_abs[i]);
}

/// One Gaussian of any shape; some are flat, some have the camera inside, some lie across the near plane.
ref::RasterScene<double> ray_scene(std::uint64_t seed) {
    Rng rng(seed);
    ref::RasterScene<double> scene;
    scene.options = ref::raster_options<double>(ref::Convention::kRayMaximum);
    const double size = std::exp(1.5 * rng.normal() - 1);
    for (int k = 0; k < 3; ++k) {
        scene.means.push_back(k < 2 ? 2 * rng.normal() : 0.21 + std::abs(2 * rng.normal()));
        scene.scales.push_back(k == 2 && seed % 4 == 0 ? 0 : size * std::exp(rng.normal()));
    }
    for (int k = 0; k < 4; ++k) scene.rotations.push_back(rng.normal());
    scene.opacities = {1};
    scene.colors = {1, 1, 1};
    scene.camera.width = scene.camera.height = 1U << 20;
    return scene;
}

/// Every pixel of a fine grid that sees a Gaussian lies in its box, and the outermost ones touch it. Of one across the
/// near plane the box is that of the ellipsoid beyond the plane, some rays of which have their maximum before it.
TEST(RasterizeReference, RayBoxesAreExact) {
    constexpr std::size_t kSide = 240;
    constexpr double kLevel = 11, kBegin = 40, kEnd = 200;
    std::size_t tight = 0, cut = 0;
    for (std::uint64_t seed = 0; seed < 200; ++seed) {
        const ref::RasterScene<double> scene = ray_scene(500 + seed);
        auto g = ref::project_gaussian(scene, ref::CameraFrame<double>(scene.camera), 0);
        if (!g.ray.used) continue;
        g.ray.camera.fx = g.ray.camera.fy = 1;
        g.ray.camera.cx = g.ray.camera.cy = 0;
        const auto x = ref::ray_extent(g, 0, kLevel), y = ref::ray_extent(g, 1, kLevel);
        g.ray.camera.fx = (kEnd - kBegin) / (x[1] - x[0]);
        g.ray.camera.fy = (kEnd - kBegin) / (y[1] - y[0]);
        g.ray.camera.cx = kBegin - g.ray.camera.fx * x[0];
        g.ray.camera.cy = kBegin - g.ray.camera.fy * y[0];
        std::array<double, 4> box = {kSide, 0, kSide, 0};
        std::size_t seen = 0;
        for (std::size_t p = 0; p < kSide * kSide; ++p) {
            const auto at = ref::ray_maximum(g, p % kSide, p / kSide);
            if (at.squared > kLevel || !(at.depth > g.ray.near_plane)) continue;
            ++seen;
            const double column = static_cast<double>(p % kSide) + 0.5;
            const double row = static_cast<double>(p / kSide) + 0.5;
            box = {std::min(box[0], column), std::max(box[1], column), std::min(box[2], row),
                   std::max(box[3], row)};
        }
        if (seen == 0) continue;
        EXPECT_GE(std::min(box[0], box[2]), kBegin - 1e-6) << seed;
        EXPECT_LE(std::max(box[1], box[3]), kEnd + 1e-6) << seed;
        const double reach = std::sqrt(kLevel * g.ray.covariance[2][2]);
        const bool across = g.camera_mean[2] - reach < g.ray.near_plane;
        cut += across ? 1 : 0;
        if (seen < 4000 || across) continue;
        ++tight;
        EXPECT_LE(std::max(box[0], box[2]), kBegin + 4) << seed;
        EXPECT_GE(std::min(box[1], box[3]), kEnd - 4) << seed;
    }
    EXPECT_GT(tight, 30U);
    EXPECT_GT(cut, 20U);
}

}  // namespace
}  // namespace splat::test
