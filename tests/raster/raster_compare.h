#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "raster/raster_outputs.h"
#include "support/raster_tolerances.h"

/// Comparisons of a rasterizer's results with golden files or the reference. The test of a
/// kernel fills a RasterOutputs or RasterGradients with what it has (to_double of
/// support/rng_fill.h) and leaves the rest empty:
///
///   for (const GoldenScene& scene : golden_scenes("rand50")) {
///       const RasterSubject subject = golden_subject(scene, mode, RasterJudge::kFloat32);
///       EXPECT_TRUE(outputs_match(got, scene.outputs(mode), subject));
///       EXPECT_TRUE(gradients_match(got_gradients, scene.gradients(mode, loss), subject));
///   }
namespace splat::test {

/// What is compared, and how strictly.
struct RasterSubject {
    std::string what;  ///< scene and mode, for messages
    RasterJudge judge = RasterJudge::kFloat32;
    std::vector<bool> fragile;     ///< [H,W]: compared loosely there
    std::vector<bool> hostile;     ///< [n] or empty: radius and gradients are exactly 0 there
    std::vector<float> opacities;  ///< [n]: a kernel may cull those below kAlphaMin in 3dgs, too
    /// What the reference in float32 gives, or null: its errors times kRasterOfFloat32 are allowed,
    /// too.
    const RasterGradients* in_float = nullptr;
    bool rays = false;  ///< depths are those of maxima along rays
};

/// Images off the fragile pixels and loosely on them, results of the projection, counts. A failure
/// names the first tensor and element. Fails also if there was nothing to compare, or if an
/// expectation holds only zeros.
testing::AssertionResult outputs_match(const RasterOutputs& got, const RasterOutputs& expected,
                                       const RasterSubject& subject);

/// Gradients, each against the largest of its tensor. Hostile Gaussians: exactly 0.
testing::AssertionResult gradients_match(const RasterGradients& got,
                                         const RasterGradients& expected,
                                         const RasterSubject& subject);

/// True if a scene's tolerances are those of needles: an axis ratio of 1000 or more somewhere.
/// Scales of 0 are points, not needles.
bool has_needles(const RasterCase& scene);

}  // namespace splat::test
