// Scenes in which a number of the rasterizer is near a limit, or much larger or smaller than another.

#include "stress/raster_scenes.h"

#include <cmath>
#include <functional>
#include <iterator>
#include <random>

#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

namespace ref = splat::ref;

double single(double value) {
    return static_cast<double>(static_cast<float>(value));
}

void round_all(std::vector<double>& values) {
    for (double& value : values) value = single(value);
}

/// Gaussians of a few pixels, 2 to 6 in front of a camera that is turned a little.
RasterScene usual_scene(std::size_t count, std::size_t width, std::size_t height,
                        ref::Convention convention) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit(-1, 1);
    RasterScene scene;
    const double focal = 0.9 * static_cast<double>(std::max(width, height));
    scene.camera.fx = focal;
    scene.camera.fy = 1.1 * focal;
    scene.camera.cx = 0.5 * static_cast<double>(width);
    scene.camera.cy = 0.5 * static_cast<double>(height);
    scene.camera.width = width;
    scene.camera.height = height;
    scene.options = ref::raster_options<double>(convention);
    scene.sh_coefficients = kShCoefficients;
    scene.background = {0.2, 0.4, 0.6};
    for (std::size_t i = 0; i < count; ++i) {
        const double z = 4 + 2 * unit(random);
        const double half_x = 0.5 * static_cast<double>(width) / focal;
        const double half_y = 0.5 * static_cast<double>(height) / focal;
        scene.means.insert(scene.means.end(),
                           {half_x * z * unit(random), half_y * z * unit(random), z});
        for (int k = 0; k < 3; ++k) scene.scales.push_back(0.15 * z * std::exp(unit(random) - 1));
        double q[4];
        double squared = 0;
        for (double& element : q) {
            element = unit(random);
            squared += element * element;
        }
        for (const double element : q) scene.rotations.push_back(element / std::sqrt(squared));
        scene.opacities.push_back(0.5 + 0.4 * unit(random));
        for (std::size_t k = 0; k < 3 * kShCoefficients; ++k)
            scene.sh.push_back(0.5 * unit(random));
    }
    return scene;
}

/// A camera that is turned and moved, with the Gaussians moved along.
void turn(RasterScene& scene, double offset) {
    const double c = std::cos(0.5);
    const double s = std::sin(0.5);
    scene.camera.world_to_camera = {c, 0, s, 0, 0, 1, 0, 0, -s, 0, c, 0, 0, 0, 0, 1};
    auto& view = scene.camera.world_to_camera;
    for (double& element : view) element = single(element);
    for (std::size_t r = 0; r < 3; ++r)
        view[4 * r + 3] = single(-offset * (view[4 * r] + view[4 * r + 1] + view[4 * r + 2]));
    for (std::size_t i = 0; i < scene.count(); ++i) {
        const double m[3] = {scene.means[3 * i], scene.means[3 * i + 1], scene.means[3 * i + 2]};
        for (std::size_t k = 0; k < 3; ++k)
            scene.means[3 * i + k] =
                offset + view[k] * m[0] + view[4 + k] * m[1] + view[8 + k] * m[2];
    }
}

/// What draws a scene, and how its gradient is defined.
struct Mode {
    const char* name;
    ref::Convention convention;
    bool antialiased;
    ref::RasterGradient gradient;
};
constexpr Mode kModes[] = {
    {"3dgs", ref::Convention::k3dgs, false, ref::RasterGradient::kTrue},
    {"gsplat", ref::Convention::kGsplat, false, ref::RasterGradient::kTrue},
    {"original", ref::Convention::k3dgs, false, ref::RasterGradient::kOriginal},
    {"antialiased", ref::Convention::kGsplat, true, ref::RasterGradient::kTrue},
    {"ray_maximum", ref::Convention::kRayMaximum, false, ref::RasterGradient::kTrue}};

/// Families of scenes, in some of the modes.
class Families {
  public:
    std::size_t modes = 2;  ///< the first ones, besides ray_maximum

    void add(const std::string& name, const std::string& input, std::size_t count,
             std::size_t width, std::size_t height,
             const std::function<void(RasterScene&)>& change) {
        for (const Mode& with : kModes) {
            const bool first = &with < kModes + modes;
            if (!first && with.convention != ref::Convention::kRayMaximum) continue;
            RasterScene scene = usual_scene(count, width, height, with.convention);
            scene.options.antialiased = with.antialiased;
            scene.options.gradient = with.gradient;
            change(scene);
            for (std::vector<double>* values :
                 {&scene.means, &scene.scales, &scene.rotations, &scene.opacities, &scene.sh})
                round_all(*values);
            for (double& element : scene.background) element = single(element);
            for (double* element :
                 {&scene.camera.fx, &scene.camera.fy, &scene.camera.cx, &scene.camera.cy})
                *element = single(*element);
            found.push_back({name + "_" + with.name, input, std::move(scene)});
        }
    }
    void add(const std::string& name, const std::string& input,
             const std::function<void(RasterScene&)>& change) {
        add(name, input, 60, 40, 28, change);
    }

    std::vector<RasterStress> found;
};

void multiply(std::vector<double>& values, double factor) {
    for (double& value : values) value *= factor;
}

void add_shapes(Families& families, bool quick) {
    families.add("usual/turned", "a turned camera", [](RasterScene& scene) { turn(scene, 3); });
    for (const int exponent :
         quick ? std::vector<int>{0, 3, 5, 7} : std::vector<int>{0, 1, 2, 3, 4, 5, 6, 7})
        families.add(format("needle/1e%d", exponent),
                     format("needles of ratio 1e%d, across the image", exponent),
                     [&](RasterScene& scene) {
                         for (std::size_t i = 0; i < scene.count(); ++i)
                             for (std::size_t k = 0; k < 3; ++k)
                                 scene.scales[3 * i + k] = k == 0 ? 1 : std::pow(10, -exponent);
                     });
    // Beyond 1e6 the gradient through the inverse of the covariance, -Q G Q, loses in float64 and in long
    // double, too, by the square of the axes' ratio in pixels: at 1e8 long double is 1e-3 off, and there is
    // no truth to compare with.
    for (const int exponent :
         quick ? std::vector<int>{-10, 3, 6} : std::vector<int>{-30, -20, -10, -5, 2, 3, 5, 6})
        families.add(format("scale/1e%d", exponent), format("scales times 1e%d", exponent),
                     [&](RasterScene& scene) { multiply(scene.scales, std::pow(10, exponent)); });
    for (const int exponent : quick ? std::vector<int>{2} : std::vector<int>{1, 2, 3, 4})
        families.add(format("needle/long_1e%d", exponent),
                     format("needles 1e%d long and 1e3 times as thin", exponent),
                     [&](RasterScene& scene) {
                         for (std::size_t i = 0; i < scene.scales.size(); ++i)
                             scene.scales[i] = std::pow(10, i % 3 == 0 ? exponent : exponent - 3);
                     });
    for (const int exponent :
         quick ? std::vector<int>{-6, 6} : std::vector<int>{-6, -3, 2, 4, 6, 8})
        families.add(format("scale/mixed_1e%d", exponent),
                     format("every second scale times 1e%d", exponent), [&](RasterScene& scene) {
                         for (std::size_t i = 0; i < scene.scales.size(); i += 2)
                             scene.scales[i] *= std::pow(10, exponent);
                         multiply(scene.opacities, 0.3);
                     });
    families.add("scale/flat", "discs of thickness 1e-7", [](RasterScene& scene) {
        for (std::size_t i = 2; i < scene.scales.size(); i += 3) scene.scales[i] = 1e-7;
    });
    families.add("quaternion/long", "rotations of length 1e3, and of 1e-3", [](RasterScene& scene) {
        if (scene.options.is_3dgs()) return;  // takes them as they are
        for (std::size_t i = 0; i < scene.rotations.size(); ++i)
            scene.rotations[i] *= i / 4 % 2 == 0 ? 1e3 : 1e-3;
    });
}

void add_places(Families& families, bool quick) {
    families.add("near/plane", "from 1e-6 before to 1e-6 behind the near plane",
                 [](RasterScene& scene) {
                     const double near = scene.options.near_plane;
                     for (std::size_t i = 0; i < scene.count(); ++i) {
                         const double z = near * (1 + (static_cast<double>(i % 7) - 3) * 1e-6);
                         const double to = z / scene.means[3 * i + 2];
                         for (std::size_t k = 0; k < 3; ++k) {
                             scene.means[3 * i + k] *= to;
                             scene.scales[3 * i + k] *= to;
                         }
                         scene.means[3 * i + 2] = z;
                     }
                 });
    families.add("near/inside", "the camera is inside of every Gaussian", [](RasterScene& scene) {
        multiply(scene.means, 0.1);
        for (double& scale : scene.scales) scale = 2 + scale;
    });
    for (const int exponent : quick ? std::vector<int>{8} : std::vector<int>{2, 4, 6, 8, 9})
        families.add(format("far/1e%d", exponent),
                     format("at 1e%d, as large in the image", exponent), [&](RasterScene& scene) {
                         multiply(scene.means, std::pow(10, exponent));
                         multiply(scene.scales, std::pow(10, exponent));
                     });
    for (const int exponent : quick ? std::vector<int>{4} : std::vector<int>{2, 4, 6})
        families.add(format("far/offset_1e%d", exponent),
                     format("camera and Gaussians 1e%d from the origin", exponent),
                     [&](RasterScene& scene) { turn(scene, std::pow(10, exponent)); });
    families.add("order/equal_depth", "all at depth 4", [](RasterScene& scene) {
        for (std::size_t i = 2; i < scene.means.size(); i += 3) scene.means[i] = 4;
    });
    families.add("order/50000", "50,000 on one pixel", 50000, 1, 1, [](RasterScene& scene) {
        for (double& opacity : scene.opacities) opacity = 0.004 + 0.002 * opacity;
    });
    for (const int exponent :
         quick ? std::vector<int>{-3, 6} : std::vector<int>{-3, -1, 1, 3, 4, 5, 6})
        families.add(format("focal/1e%d", exponent),
                     format("focal length of 1e%d pixels", exponent), [&](RasterScene& scene) {
                         const double factor = std::pow(10, exponent) / scene.camera.fx;
                         scene.camera.fx *= factor;
                         scene.camera.fy *= factor;
                         if (factor < 1) return;
                         for (std::size_t i = 0; i < scene.means.size(); ++i)
                             if (i % 3 != 2) scene.means[i] /= factor;
                         multiply(scene.scales, 1 / factor);
                     });
}

void add_values(Families& families, bool quick) {
    families.add(
        "opacity/thresholds", "opacities at 1/255, 0.99 and 1, one rounding off",
        [](RasterScene& scene) {
            const float edges[] = {splat::raster::kAlphaMin, splat::raster::kAlphaMax, 1.0F};
            for (std::size_t i = 0; i < scene.count(); ++i) {
                float opacity = edges[i % 3];
                if (i / 3 % 3 == 1) opacity = std::nextafter(opacity, 0.0F);
                if (i / 3 % 3 == 2 && i % 3 != 2) opacity = std::nextafter(opacity, 1.0F);
                scene.opacities[i] = static_cast<double>(opacity);
            }
        });
    families.add("opacity/opaque", "every opacity 1", [](RasterScene& scene) {
        for (double& opacity : scene.opacities) opacity = 1;
    });
    families.add("opacity/faint", "every opacity 0.0045", [](RasterScene& scene) {
        for (double& opacity : scene.opacities) opacity = 0.0045;
    });
    for (const int exponent : quick ? std::vector<int>{4, 20, 30}
                                    : std::vector<int>{-30, -10, 4, 10, 18, 20, 25, 30, 37})
        families.add(format("sh/1e%d", exponent), format("harmonics of 1e%d", exponent),
                     [&](RasterScene& scene) { multiply(scene.sh, std::pow(10, exponent)); });
    for (const int exponent : quick ? std::vector<int>{25} : std::vector<int>{10, 20, 25, 30})
        families.add(format("sh/mixed_1e%d", exponent),
                     format("harmonics of every third Gaussian of 1e%d", exponent),
                     [&](RasterScene& scene) {
                         for (std::size_t i = 0; i < scene.sh.size(); ++i)
                             if (i / (3 * kShCoefficients) % 3 == 0)
                                 scene.sh[i] *= std::pow(10, exponent);
                     });
    families.add("image/1x1", "an image of one pixel", 60, 1, 1, [](RasterScene&) {});
    families.add("image/16384x16", "an image of 16384 x 16 pixels", 12, 16384, 16,
                 [](RasterScene&) {});
}

}  // namespace

RasterScene bench_scene() {
    RasterScene scene = usual_scene(3000, 160, 120, ref::Convention::k3dgs);
    multiply(scene.scales, 0.1);
    for (std::vector<double>* values :
         {&scene.means, &scene.scales, &scene.rotations, &scene.opacities, &scene.sh})
        round_all(*values);
    return scene;
}

std::vector<RasterStress> raster_families(bool quick) {
    Families families;
    families.modes = std::size(kModes);
    add_shapes(families, quick);
    families.modes = 2;
    add_places(families, quick);
    add_values(families, quick);
    return std::move(families.found);
}

}  // namespace vkrun::stress
