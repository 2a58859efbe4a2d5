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

/// The losses of which a file holds gradients.
struct GoldenLoss {
    const char* name;      ///< folder below the mode's
    bool alpha_and_depth;  ///< w_alpha and w_depth on top of w_rgb
    ref::RasterGradient gradient;
};

/// Those of a mode: in 3dgs `grad_rgb` is the original's, and the true one has its own name.
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

/// All of a family, e.g. "rand2000_sh3"; what cannot be read is recorded as a failure.
std::vector<GoldenScene> golden_scenes(const std::string& family);

/// What raster_compare.h wants to know of a golden scene; `needles` of the judge is added here.
RasterSubject golden_subject(const GoldenScene& scene, const RasterMode& mode, RasterJudge judge);

/// Families that the index lists, in its order. Files of other names are run, too, by
/// golden_scenes("").
inline constexpr const char* kGoldenFamilies[] = {
    "one",      "rand50",    "rand2000_sh3", "opaque", "elongated", "nearplane",
    "subpixel", "offcentre", "splatter64",   "ties",   "widefov",   "hostile",
};

}  // namespace splat::test
