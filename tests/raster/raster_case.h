#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "ref/raster_scene_ref.h"

namespace splat::test {

/// A convention, named like the folders in golden/raster/*.npz.
struct RasterMode {
    const char* name;
    ref::Convention convention;
    bool antialiased;
    bool sort_by_distance = false;
    bool cut_3_sigma = false;

    [[nodiscard]] bool is_3dgs() const { return convention == ref::Convention::k3dgs; }
    [[nodiscard]] bool is_ray() const { return convention == ref::Convention::kRayMaximum; }
};

inline constexpr RasterMode kRasterModes[] = {
    {"3dgs", ref::Convention::k3dgs, false},
    {"gsplat", ref::Convention::kGsplat, false},
    {"gsplat_aa", ref::Convention::kGsplat, true},
};

/// Forward only.
inline constexpr RasterMode kRayModes[] = {
    {"ray_maximum", ref::Convention::kRayMaximum, false},
    {"ray_maximum as glTF", ref::Convention::kRayMaximum, false, true, true},
};

/// By distance and cut at 3 sigma, each alone, and both in either convention.
inline constexpr RasterMode kDrawnModes[] = {
    {"3dgs by distance", ref::Convention::k3dgs, false, true, false},
    {"3dgs cut", ref::Convention::k3dgs, false, false, true},
    {"3dgs as glTF", ref::Convention::k3dgs, false, true, true},
    {"gsplat_aa as glTF", ref::Convention::kGsplat, true, true, true},
};

/// A scene in float32, as kernels read it, so that the float64 reference starts from the same
/// numbers.
struct RasterCase {
    std::string name;
    std::vector<float> means;      ///< [n,3]
    std::vector<float> scales;     ///< [n,3] linear
    std::vector<float> rotations;  ///< [n,4] w, x, y, z
    std::vector<float> opacities;  ///< [n] linear
    std::vector<float> sh;         ///< [n,sh_coefficients,3], or empty if there are colors
    std::vector<float> colors;     ///< [n,3], or empty
    std::size_t sh_coefficients = 0;
    std::array<float, 3> background{};
    ref::RasterCamera<float> camera;

    [[nodiscard]] std::size_t count() const { return opacities.size(); }
    [[nodiscard]] std::size_t pixels() const { return camera.width * camera.height; }
};

/// The scene for the reference, in double, or in float to measure float32.
template <class Real>
ref::RasterScene<Real> reference_scene(const RasterCase& from, const RasterMode& mode,
                                       ref::RasterGradient gradient = ref::RasterGradient::kTrue) {
    const auto widened = [](const std::vector<float>& values) {
        return std::vector<Real>(values.begin(), values.end());
    };
    ref::RasterScene<Real> scene;
    scene.means = widened(from.means);
    scene.scales = widened(from.scales);
    scene.rotations = widened(from.rotations);
    scene.opacities = widened(from.opacities);
    scene.sh = widened(from.sh);
    scene.colors = widened(from.colors);
    scene.sh_coefficients = from.sh_coefficients;
    for (std::size_t k = 0; k < 3; ++k) scene.background[k] = static_cast<Real>(from.background[k]);
    scene.camera = {static_cast<Real>(from.camera.fx),
                    static_cast<Real>(from.camera.fy),
                    static_cast<Real>(from.camera.cx),
                    static_cast<Real>(from.camera.cy),
                    from.camera.width,
                    from.camera.height,
                    {}};
    for (std::size_t k = 0; k < 16; ++k)
        scene.camera.world_to_camera[k] = static_cast<Real>(from.camera.world_to_camera[k]);
    scene.options = ref::raster_options<Real>(mode.convention, mode.antialiased, gradient);
    scene.options.sort_by_distance = mode.sort_by_distance;
    scene.options.cut_3_sigma = mode.cut_3_sigma;
    return scene;
}

}  // namespace splat::test
