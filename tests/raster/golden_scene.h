#pragma once

#include <string>
#include <vector>

#include "raster/raster_case.h"
#include "raster/raster_compare.h"
#include "raster/raster_outputs.h"
#include "support/golden.h"
#include "support/npz.h"

/// Scenes of golden/raster/*.npz; tests/golden/raster/INDEX.md says what they hold.
namespace splat::test {

/// Losses for which a file may hold gradients.
struct GoldenLoss {
    const char* name;      ///< folder below the mode's
    bool alpha_and_depth;  ///< w_alpha and w_depth on top of w_rgb
    ref::RasterGradient gradient;
};

/// The losses of a mode. In 3dgs `grad_rgb` is the original's gradient; the true one has a name of
/// its own.
std::vector<GoldenLoss> golden_losses(const RasterMode& mode);

struct GoldenScene {
    RasterCase inputs;
    std::vector<float> w_rgb;    ///< [H,W,3] weights of the losses; 0 where fragile
    std::vector<float> w_alpha;  ///< [H,W], may be empty
    std::vector<float> w_depth;  ///< [H,W], may be empty
    std::vector<bool> fragile;   ///< [H,W] pixels that rounding decides
    std::vector<bool> hostile;   ///< [n] Gaussians that must come out as absent; else empty
    std::vector<std::string> why;
    Npz arrays;

    [[nodiscard]] bool has(const RasterMode& mode) const;

    /// Expected results; a field is empty if the file has no such key.
    [[nodiscard]] RasterOutputs outputs(const RasterMode& mode) const;
    [[nodiscard]] RasterGradients gradients(const RasterMode& mode, const GoldenLoss& loss) const;

    /// A scalar of the file; a missing one is a test failure.
    [[nodiscard]] double number(const std::string& name) const;

    template <class Real>
    [[nodiscard]] ref::RasterLoss<Real> loss(const GoldenLoss& which) const {
        const auto widened = [](const std::vector<float>& values) {
            return std::vector<Real>(values.begin(), values.end());
        };
        ref::RasterLoss<Real> weights;
        weights.grad_rgb = widened(w_rgb);
        if (which.alpha_and_depth) {
            weights.grad_alpha = widened(w_alpha);
            weights.grad_depth = widened(w_depth);
        }
        return weights;
    }
};

/// Errors: those of Npz::read, a missing input.
Result<GoldenScene> read_golden_scene(const std::string& path);

/// All scenes of a family, e.g. "rand2000_sh3". A file that cannot be read fails the test.
std::vector<GoldenScene> golden_scenes(const std::string& family);

/// The subject of raster_compare.h for a golden scene. Chooses the judge's figures for needles
/// itself.
RasterSubject golden_subject(const GoldenScene& scene, const RasterMode& mode, RasterJudge judge);

/// Families in the order of the index. golden_scenes("") also reads files of other names.
inline constexpr const char* kGoldenFamilies[] = {
    "one",      "rand50",    "rand2000_sh3", "opaque", "elongated", "nearplane",
    "subpixel", "offcentre", "splatter64",   "ties",   "widefov",   "hostile",
};

}  // namespace splat::test
