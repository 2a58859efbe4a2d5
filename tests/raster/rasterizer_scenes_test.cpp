// Numerically hard scenes in every mode, against the float64 reference.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "ops/op_harness.h"
#include "raster/fragile.h"
#include "raster/raster_scenes.h"
#include "raster/raster_session.h"
#include "support/rng_fill.h"
#include "support/tolerances.h"

namespace splat::test {
namespace {

class RasterizerScenes : public KernelsTest {
  protected:
    /// Compares in all modes. Fails if the mask hides most of the image, as that would prove
    /// nothing.
    void expect_all_modes(const RasterCase& scene, double most_fragile = 0.3) {
        for (const RasterMode& mode : kRasterModes) {
            const ReferenceRun got = expect_like_reference(context(), scene, mode);
            EXPECT_LE(got.fragile, most_fragile) << scene.name << " " << mode.name;
        }
    }
};
SPLAT_INSTANTIATE_KERNELS(RasterizerScenes);

TEST_P(RasterizerScenes, SphericalHarmonicsOfEveryDegree) {
    for (std::size_t degree = 0; degree <= 3; ++degree) {
        SCOPED_TRACE(degree);
        expect_all_modes(random_scene({60, 37, 29}, 40 + degree, degree));
    }
}

TEST_P(RasterizerScenes, DirectColors) {
    RasterCase scene = random_scene({60, 37, 29}, 45, 0);
    scene.colors = scene.sh;
    scene.sh.clear();
    scene.sh_coefficients = 0;
    expect_all_modes(scene);
}

TEST_P(RasterizerScenes, OriginalGradient) {
    for (const RasterCase& scene : {wide_scene({30, 37, 29}, 46), opaque_scene({30, 37, 29}, 47),
                                    random_scene({60, 33, 20}, 48)})
        expect_like_reference(context(), scene, kRasterModes[0], ref::RasterGradient::kOriginal);
}

TEST_P(RasterizerScenes, OffCentreAndUnequalFocalLengths) {
    RasterCase scene = random_scene({60, 37, 50}, 49, 1);
    scene.camera.cx *= 0.6F;
    scene.camera.cy *= 1.3F;
    scene.camera.fy *= 1.4F;
    expect_all_modes(scene);
}

TEST_P(RasterizerScenes, BesideTheFieldOfView) {
    expect_all_modes(wide_scene({40, 37, 29}, 50));
}

TEST_P(RasterizerScenes, SaturatedPixels) {
    expect_all_modes(opaque_scene({60, 37, 29}, 51));
}

TEST_P(RasterizerScenes, OpacityOfOne) {
    RasterCase scene = random_scene({60, 37, 29}, 52, 0);
    std::fill(scene.opacities.begin(), scene.opacities.end(), 1.0F);
    expect_all_modes(scene);
}

/// More columns or rows of tiles than a packed footprint has.
TEST_P(RasterizerScenes, LargeFootprints) {
    for (const SceneSize& size : {SceneSize{10, 330, 37}, SceneSize{10, 37, 200}}) {
        RasterCase scene = random_scene(size, 61, 0);
        for (float& scale : scene.scales) scale *= 4;
        expect_all_modes(scene);
    }
}

TEST_P(RasterizerScenes, Splatter) {
    expect_all_modes(splatter_scene(20, 40, 33, 53));
}

/// With equal depths the image depends on the order, which must be that of the indices.
TEST_P(RasterizerScenes, EqualDepthsInOrderOfIndices) {
    const RasterCase scene = tie_scene({80, 37, 29}, 54);
    expect_all_modes(scene);
    RasterCase reversed = scene;
    const auto reverse = [](std::vector<float>& values, std::size_t width) {
        const std::vector<float> from = values;
        for (std::size_t i = 0; i < values.size(); ++i)
            values[i] = from[(values.size() / width - 1 - i / width) * width + i % width];
    };
    reverse(reversed.means, 3);
    reverse(reversed.scales, 3);
    reverse(reversed.rotations, 4);
    reverse(reversed.opacities, 1);
    reverse(reversed.sh, 3 * scene.sh_coefficients);
    const raster::RasterDesc desc = raster_desc(scene, kRasterModes[1]);
    EXPECT_GT(relative_difference(raster_image(context(), scene, desc),
                                  raster_image(context(), reversed, desc)),
              0.01)
        << "the scene has no ties";
}

/// The camera is inside the ball: Gaussians surround it, cross the near plane, and are wider than
/// the image. Rounding decides most pixels, so this mostly compares projections.
TEST_P(RasterizerScenes, CameraInside) {
    RasterCase scene = random_scene({60, 37, 29}, 55, 1);
    scene.camera.world_to_camera[11] = 0;
    expect_all_modes(scene, 1);
}

TEST_P(RasterizerScenes, ScalesOfZeroAndNearlyZero) {
    RasterCase scene = random_scene({90, 37, 29}, 56, 0);
    for (std::size_t i = 0; i < scene.scales.size(); ++i) {
        const std::size_t way = i / 3 % 6;
        if (way == 0) scene.scales[i] = 0;
        if (way == 1) scene.scales[i] = 1e-20F;
        if (way == 2 && i % 3 == 0) scene.scales[i] = 0;
        if (way == 3) scene.scales[i] = 1e-12F;
    }
    // Points project to the dilation alone, so exact ties of alpha with thresholds are rare.
    expect_all_modes(scene);
}

TEST_P(RasterizerScenes, HugeScales) {
    RasterCase scene = random_scene({60, 37, 29}, 57, 0);
    for (std::size_t i = 0; i < scene.count(); ++i) {
        for (std::size_t k = 0; k < 3 && i % 3 == 0; ++k)
            scene.scales[3 * i + k] *= i % 2 == 0 ? 1e3F : 1e5F;
        scene.opacities[i] *= 0.3F;
    }
    expect_all_modes(scene, 1);
}

/// Gaussians that float32 cannot project are absent: those whose sums of squares overflow.
TEST_P(RasterizerScenes, OverflowingScalesAreAbsent) {
    RasterCase with = random_scene({60, 37, 29}, 58, 0);
    for (const float scale : {1e13F, 1e20F, 3e38F}) {
        for (std::size_t i = 0; i < with.count(); i += 3)
            std::fill_n(&with.scales[3 * i], 3, scale);
        RasterCase without = with;
        for (std::size_t i = 0; i < with.count(); i += 3) without.opacities[i] = 0;
        for (const RasterMode& mode : kRasterModes)
            EXPECT_EQ(raster_image(context(), with, raster_desc(with, mode)),
                      raster_image(context(), without, raster_desc(without, mode)))
                << mode.name << " " << scale;
    }
}

/// Rows of the Gaussians that stay, `width` numbers each.
std::vector<float> rows_of(std::span<const float> all, const std::vector<bool>& hostile,
                           std::size_t width, bool kept) {
    std::vector<float> rows;
    for (std::size_t i = 0; i < hostile.size(); ++i)
        if (hostile[i] != kept)
            rows.insert(rows.end(), all.begin() + static_cast<std::ptrdiff_t>(i * width),
                        all.begin() + static_cast<std::ptrdiff_t>((i + 1) * width));
    return rows;
}

/// Image, depth and all gradients have the same bits as without the invalid Gaussians, whose
/// gradients are 0. Without ties, the order by depth does not depend on missing Gaussians.
TEST_P(RasterizerScenes, HostileOnesAreAbsent) {
    const HostileScene scene = hostile_scene({128, 37, 29}, 59);
    const std::size_t n = scene.with.count();
    for (const RasterMode& mode : kRasterModes) {
        SCOPED_TRACE(mode.name);
        ref::RasterLoss<double> loss;
        loss.grad_rgb = to_double(normal_fill(3 * scene.with.pixels(), 1));
        loss.grad_alpha = to_double(normal_fill(scene.with.pixels(), 2));
        loss.grad_depth = to_double(normal_fill(scene.with.pixels(), 3));
        const raster::RasterDesc desc = raster_desc(scene.with, mode);
        const RasterRun with = run_raster(context(), scene.with, desc, &loss);
        raster::RasterDesc fewer = desc;
        fewer.gaussians = static_cast<std::uint32_t>(scene.without.count());
        const RasterRun without = run_raster(context(), scene.without, fewer, &loss);
        ASSERT_OK(with.status);
        ASSERT_OK(without.status);
        EXPECT_EQ(with.image, without.image);
        EXPECT_EQ(with.outputs.depth, without.outputs.depth);
        EXPECT_EQ(with.outputs.n_contrib, without.outputs.n_contrib);
        EXPECT_EQ(with.stats.pairs, without.stats.pairs);
        const std::span<const float> all(with.packed);
        const std::size_t colors = std::size_t{4} * desc.color_quads();
        EXPECT_EQ(rows_of(all, scene.hostile, 12, true),
                  std::vector<float>(without.packed.begin(),
                                     without.packed.begin() +
                                         static_cast<std::ptrdiff_t>(12 * scene.without.count())));
        for (const float g : rows_of(all, scene.hostile, 12, false)) ASSERT_EQ(g, 0.0F);
        for (const float g : rows_of(all.subspan(12 * n), scene.hostile, colors, false))
            ASSERT_EQ(g, 0.0F);
    }
}

/// Spec: median <= 2e-7, no determinant <= 0; a c - b^2 has a median of 6e-5 and loses hundreds.
void expect_conics(vk::Context& context, double length) {
    const RasterCase needles = needle_scene({4000, 200, 160}, 50, length);
    const auto exact = ref::project_forward(reference_scene<double>(needles, kRasterModes[1]));
    const RasterRun run = run_raster(context, needles, raster_desc(needles, kRasterModes[1]));
    ASSERT_OK(run.status);
    std::vector<double> errors;
    std::size_t refused = 0;
    for (const std::uint32_t i : exact.order) {
        const double* got = &run.outputs.conics[std::size_t{3} * i];
        const std::array<double, 3>& expected = exact.gaussians[i].conic;
        if (run.outputs.valid[i] == 0 || !(got[0] * got[2] - got[1] * got[1] > 0)) ++refused;
        double off = 0;
        double size = 0;
        for (std::size_t k = 0; k < 3; ++k) {
            off = std::max(off, std::abs(got[k] - expected[k]));
            size = std::max(size, std::abs(expected[k]));
        }
        errors.push_back(off / size);
    }
    ASSERT_GT(errors.size(), 3000U);
    std::sort(errors.begin(), errors.end());
    std::printf("length %g: %zu needles, median %.2g, worst %.2g, %zu refused\n", length,
                errors.size(), errors[errors.size() / 2], errors.back(), refused);
    EXPECT_LE(errors[errors.size() / 2], kRoundings * 2e-7);
    EXPECT_LE(errors.back(), 2e-5) << "the row conics of raster_tolerances.h";
    EXPECT_EQ(refused, 0U);
}

TEST_P(RasterizerScenes, ConicsOfNeedles) {
    expect_conics(context(), 1);
}

/// ||got - expected|| / ||expected|| of a tensor.
double error_of(const std::vector<double>& got, const std::vector<double>& expected) {
    double error = 0;
    double norm = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        error += (got[i] - expected[i]) * (got[i] - expected[i]);
        norm += expected[i] * expected[i];
    }
    return std::sqrt(error / norm);
}

/// The worst tensor of the gradients of a scene in all modes. The reference's -Q Gq Q A loses the square of the
/// ratio of the axes, in pixels: in float64 1e-3 at 5e7, in the 64 bits of mantissa that it has here where the
/// machine has them 1e-3 at 5e9. Scenes of larger ratios test the reference.
double gradient_error(vk::Context& context, const RasterCase& scene, double weights = 1) {
    double worst = 0;
    for (const RasterMode& mode : kRasterModes) {
        ref::RasterLoss<double> loss;
        const std::vector<bool> fragile = fragile_pixels(reference_scene<double>(scene, mode));
        loss.grad_rgb = to_double(loss_weights(fragile, 3, 21));
        loss.grad_alpha = to_double(loss_weights(fragile, 1, 22));
        for (double& weight : loss.grad_rgb)
            weight = static_cast<double>(static_cast<float>(weight * weights));
        RasterRun run = run_raster(context, scene, raster_desc(scene, mode), &loss);
        EXPECT_OK(run.status);
        if (!run.status.ok()) return worst;
        ref::RasterLoss<long double> exact_loss;
        exact_loss.grad_rgb.assign(loss.grad_rgb.begin(), loss.grad_rgb.end());
        exact_loss.grad_alpha.assign(loss.grad_alpha.begin(), loss.grad_alpha.end());
        RasterGradients expected =
            reference_gradients(reference_scene<long double>(scene, mode), exact_loss);
        for (std::size_t i = 0; i < scene.scales.size(); ++i) {  // by the logarithm, as in training
            run.gradients.scales[i] *= static_cast<double>(scene.scales[i]);
            expected.scales[i] *= static_cast<double>(scene.scales[i]);
        }
        const double errors[] = {error_of(run.gradients.means, expected.means),
                                 error_of(run.gradients.scales, expected.scales),
                                 error_of(run.gradients.rotations, expected.rotations),
                                 error_of(run.gradients.opacities, expected.opacities),
                                 error_of(run.gradients.means2d, expected.means2d)};
        std::printf(
            "%s %s: means %.1e, scales %.1e, rotations %.1e, opacities %.1e, means2d %.1e\n",
            scene.name.c_str(), mode.name, errors[0], errors[1], errors[2], errors[3], errors[4]);
        for (const double error : errors) worst = std::max(worst, error);
    }
    return worst;
}

TEST_P(RasterizerScenes, GradientsOfNeedles) {
    for (const double length : {1.0, 10.0, 100.0})
        EXPECT_LE(gradient_error(context(), needle_scene({12, 50, 41}, 62, length)), 2e-5)
            << length;
}

TEST_P(RasterizerScenes, GradientsOfExtremeScales) {
    for (const float factor : {1e-6F, 1e2F, 1e4F, 1e6F}) {
        RasterCase scene = random_scene({8, 37, 29}, 63, 1);
        for (std::size_t i = 0; i < scene.scales.size(); ++i)
            if (i % 2 == 0) scene.scales[i] *= factor;
        for (float& opacity : scene.opacities) opacity *= 0.3F;
        scene.name += " times " + std::to_string(factor);
        EXPECT_LE(gradient_error(context(), scene), 2e-5) << factor;
    }
}

/// Colours of 1e20 and more are numbers like others; so are their gradients, up to what float32 holds.
TEST_P(RasterizerScenes, HugeColors) {
    for (const float factor : {1e10F, 1e20F, 1e25F, 1e30F}) {
        RasterCase scene = random_scene({30, 37, 29}, 64, 2);
        for (std::size_t i = 0; i < scene.sh.size(); ++i)
            if (i / 27 % 3 == 0) scene.sh[i] *= factor;
        for (std::size_t i = 0; i < scene.scales.size(); ++i)
            if (i / 3 % 6 == 0) scene.scales[i] *= 1e4F;
        scene.name += " colours times " + std::to_string(factor);
        EXPECT_LE(gradient_error(context(), scene), 2e-5) << factor;
    }
}

/// A single harmonic of 3e38, of either sign, is a colour that float32 holds; with small weights of the loss so
/// are the gradients.
TEST_P(RasterizerScenes, LargestColors) {
    RasterCase scene = random_scene({12, 21, 18}, 65, 2);
    for (std::size_t i = 0; i < scene.sh.size(); ++i)
        scene.sh[i] = i / 3 % 9 == i / 27 % 9 ? std::copysign(3e38F, scene.sh[i]) : 0.0F;
    scene.name += ", harmonics of 3e38";
    EXPECT_LE(gradient_error(context(), scene, 1e-3), 2e-5);
}

/// Where a sum of gradients exceeds float32 it is not finite, but no colour makes an image NaN.
TEST_P(RasterizerScenes, HugeColorsMakeNoNan) {
    for (const float factor : {1e20F, 1e30F, 1e37F, 3e38F}) {
        RasterCase scene = random_scene({12, 21, 18}, 66, 2);
        for (std::size_t i = 0; i < scene.sh.size(); ++i)
            if (i / 27 % 3 != 1) scene.sh[i] = std::copysign(factor, scene.sh[i]);
        for (const RasterMode& mode : kRasterModes) {
            ref::RasterLoss<double> loss;
            const std::vector<bool> none(scene.pixels(), false);
            loss.grad_rgb = to_double(loss_weights(none, 3, 21));
            loss.grad_alpha = to_double(loss_weights(none, 1, 22));
            const RasterRun run = run_raster(context(), scene, raster_desc(scene, mode), &loss);
            ASSERT_OK(run.status);
            const auto expect_no_nan = [&](const char* name, const std::vector<double>& values) {
                EXPECT_TRUE(std::none_of(values.begin(), values.end(),
                                         [](double value) { return std::isnan(value); }))
                    << name << ", " << factor << " " << mode.name;
            };
            expect_no_nan("rgb", run.outputs.rgb);
            expect_no_nan("sh", run.gradients.sh);
            if (factor > 1e37F) continue;
            expect_no_nan("means", run.gradients.means);
            expect_no_nan("scales", run.gradients.scales);
            expect_no_nan("rotations", run.gradients.rotations);
            expect_no_nan("opacities", run.gradients.opacities);
        }
    }
}

class RasterizerScenesFull : public RasterizerScenes {};
SPLAT_INSTANTIATE_KERNELS(RasterizerScenesFull);

TEST_P(RasterizerScenesFull, ConicsOfLongerNeedles) {
    expect_conics(context(), 30);
    expect_conics(context(), 1000);
}

TEST_P(RasterizerScenes, ImagesOfNeedles) {
    expect_all_modes(needle_scene({60, 50, 41}, 60), 0.6);
}

}  // namespace
}  // namespace splat::test
