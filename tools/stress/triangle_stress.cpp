// Depth and normals of meshes against rays in float64, over sizes, places and shapes.

#include <algorithm>
#include <cmath>
#include <random>

#include "ref/triangles_ref.h"
#include "stress/stress.h"
#include "vkrun/cli/text.h"

namespace vkrun::stress {
namespace {

using splat::ref::RefSample;
using splat::ref::RefTriangle;
using splat::ref::TriangleCamera;
using splat::ref::Vec;

constexpr std::uint32_t kColumns = 48, kRows = 36;
/// By Vulkan's table: a weight is a quotient of sums, a normal is twice divided by a length, which is a root.
constexpr double kDepthRoundings = 16, kNormalRoundings = 40;
constexpr double kAny = 1e3;  ///< farther than any result lies, so that none of these is the worst
constexpr double kHalf = 32;  ///< the power of two from half a side on, which scales depths
constexpr const char* kTriangleReason =
    "corners are rounded to 2^-24 of the greatest of their terms; a plane that moves by e moves a "
    "ray's depth by e over "
    "the cosine between both";

struct TriangleScene {
    std::vector<std::array<Vec, 3>> triangles;
    TriangleCamera camera;
    Vec low{}, high{};

    [[nodiscard]] Vec middle() const {
        return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2, (low[2] + high[2]) / 2};
    }
    [[nodiscard]] double diagonal() const {
        const Vec size = splat::ref::difference_of(high, low);
        return std::sqrt(splat::ref::dot_of(size, size));
    }
};

struct TriangleStress {
    std::string name, input;
    TriangleScene scene;
};

/// Looks at `target` from `eye`, z up.
TriangleCamera looking(const Vec& eye, const Vec& target, double focal) {
    const auto unit = [](const Vec& v) {
        return splat::ref::scaled(v, 1 / std::sqrt(splat::ref::dot_of(v, v)));
    };
    const Vec front = unit(splat::ref::difference_of(target, eye));
    const Vec right = unit(splat::ref::cross_of(front, {0, 0, 1}));
    const Vec down = splat::ref::cross_of(front, right);
    TriangleCamera camera{focal, focal, kColumns / 2.0, kRows / 2.0, {}};
    for (std::size_t row = 0; row < 3; ++row) {
        const Vec& axis = row == 0 ? right : row == 1 ? down : front;
        std::copy(axis.begin(), axis.end(), &camera.world_to_camera[4 * row]);
        camera.world_to_camera[4 * row + 3] = -splat::ref::dot_of(axis, eye);
    }
    camera.world_to_camera[15] = 1;
    return camera;
}

/// Random triangles of about 0.4 in the cube from -1 to 1.
std::vector<std::array<Vec, 3>> soup(std::size_t count) {
    std::mt19937 random(5);
    std::uniform_real_distribution<double> place(-1, 1);
    const auto point = [&](double size, const Vec& middle) {
        Vec at{};
        for (std::size_t k = 0; k < 3; ++k) at[k] = middle[k] * (1 - size) + place(random) * size;
        return at;
    };
    std::vector<std::array<Vec, 3>> triangles(count);
    for (auto& triangle : triangles) {
        const Vec middle = point(1, {});
        for (Vec& corner : triangle) corner = point(0.4, middle);
    }
    return triangles;
}

/// A tilted square of 2 * count slivers, each 2 long.
std::vector<std::array<Vec, 3>> slivers(int count) {
    std::vector<std::array<Vec, 3>> triangles;
    const auto at = [&](double side, int row) {
        const double across = 2.0 * row / count - 1;
        return Vec{side, across, 0.3 * side - 0.4 * across};
    };
    for (int row = 0; row < count; ++row) {
        triangles.push_back({at(-1, row), at(1, row), at(1, row + 1)});
        triangles.push_back({at(1, row + 1), at(-1, row + 1), at(-1, row)});
    }
    return triangles;
}

/// Everything, and the camera with it, times `size`, then moved by `offset`.
TriangleScene placed_scene(std::vector<std::array<Vec, 3>> triangles, const Vec& eye, double focal,
                           double size = 1, double offset = 0) {
    const auto moved = [&](const Vec& v) {
        return Vec{v[0] * size + offset, v[1] * size - offset, v[2] * size + offset};
    };
    TriangleScene scene{std::move(triangles), looking(moved(eye), moved({}), focal)};
    scene.low.fill(std::numeric_limits<double>::infinity());
    scene.high.fill(-std::numeric_limits<double>::infinity());
    for (auto& triangle : scene.triangles)
        for (Vec& corner : triangle) {
            corner = moved(corner);
            for (std::size_t k = 0; k < 3; ++k) {
                scene.low[k] = std::min(scene.low[k], corner[k]);
                scene.high[k] = std::max(scene.high[k], corner[k]);
            }
        }
    return scene;
}

std::vector<TriangleStress> triangle_families(bool quick) {
    const Vec eye{2, 1.5, 1};
    const std::size_t count = quick ? 100 : 300;
    std::vector<TriangleStress> families;
    const auto add = [&](const std::string& name, const std::string& input, TriangleScene scene) {
        families.push_back({"triangles/" + name, input, std::move(scene)});
    };
    add("usual", "random triangles", placed_scene(soup(count), eye, 40));
    add("within", "the camera is among them", placed_scene(soup(count), {0.3, 0.1, 0.2}, 30));
    for (const int exponent : {-12, 15})
        add(format("size_1e%d", exponent), format("a size of 1e%d", exponent),
            placed_scene(soup(count), eye, 40, std::pow(10, exponent)));
    for (const int exponent : {3, 6})
        add(format("offset_1e%d", exponent), format("1e%d sizes from the origin", exponent),
            placed_scene(soup(count), eye, 40, 1, std::pow(10, exponent)));
    for (const int exponent : {2, 4})
        add(format("distance_1e%d", exponent), format("seen from 1e%d sizes", exponent),
            placed_scene(soup(count), splat::ref::scaled(eye, std::pow(10, exponent)),
                         40 * std::pow(10, exponent)));
    for (const int rows : {30, 1000})
        add(format("slivers_%d", rows), format("triangles that are %d times as long", rows),
            placed_scene(slivers(rows), eye, 40));
    for (const int tenths : {20, 2})
        add(format("grazing_%d", tenths), format("a plane seen at %g of its size", tenths / 100.0),
            placed_scene(slivers(30), {2, 0, 0.6 + tenths / 50.0}, 40));
    return families;
}

std::vector<RefTriangle> ref_triangles(const TriangleScene& scene) {
    std::vector<RefTriangle> triangles(scene.triangles.size());
    for (std::size_t i = 0; i < triangles.size(); ++i) triangles[i].corners = scene.triangles[i];
    return triangles;
}

/// How far a corner may lie from where it is, in the camera's axes.
double corner_error(const TriangleScene& scene) {
    const auto& m = scene.camera.world_to_camera;
    const Vec seen = scene.camera.placed(scene.middle());
    double error = 0, most = 0;
    std::array<double, 3> terms{};
    for (std::size_t row = 0; row < 3; ++row) {
        terms[row] = std::abs(seen[row]);
        for (std::size_t k = 0; k < 3; ++k)
            terms[row] += std::abs(m[4 * row + k]) * (scene.high[k] - scene.low[k]) / 2;
    }
    const double units[] = {scene.camera.fx, scene.camera.fy, kHalf};
    for (std::size_t row = 0; row < 3; ++row) most = std::max(most, units[row] * terms[row]);
    // Half of a unit, which is at most 2^-23 of the greatest; four roundings of the sum and one of each factor.
    for (const double unit : units) error += (0.5 * 0x1p-23 + 8 * kRounding) * most / unit;
    return error;
}

/// What the mean of the corners' depths sums, in magnitudes.
double depth_terms(const TriangleScene& scene, const RefSample& sample) {
    double sum = 0;
    if (sample.hit)
        for (std::size_t k = 0; k < 3; ++k)
            sum += sample.hit->weights[k] *
                   std::abs(scene.camera.placed(scene.triangles[sample.hit->triangle][k])[2]);
    return sum;
}

/// Expected depth and normals.
std::pair<Expected, Expected> expected_maps(const TriangleScene& scene) {
    const std::vector<RefTriangle> triangles = ref_triangles(scene);
    const double error = corner_error(scene), near = 1e-3 * scene.diagonal();
    const double middle = scene.camera.placed(scene.middle())[2];
    const double nearest = std::max(near, middle - scene.diagonal() / 2);
    const double farthest = middle + scene.diagonal() / 2;
    Expected depth, normal;
    for (std::size_t i = 0; i < std::size_t{kColumns} * kRows; ++i) {
        const double x = static_cast<double>(i % kColumns) + 0.5,
                     y = static_cast<double>(i / kColumns) + 0.5;
        const RefSample sample = splat::ref::cast(triangles, scene.camera, x, y, near);
        const RefSample nearer = splat::ref::cast(triangles, scene.camera, x, y, near - 4 * error);
        const RefSample farther = splat::ref::cast(triangles, scene.camera, x, y, near + 4 * error);
        const auto triangle = [](const RefSample& of) { return of.hit ? of.hit->triangle + 1 : 0; };
        const double z = sample.hit ? sample.hit->z : 0;
        const Vec ray{(x - scene.camera.cx) / scene.camera.fx,
                      (y - scene.camera.cy) / scene.camera.fy, 1};
        const double moved =
            sample.hit ? error / (sample.hit->cosine * std::sqrt(splat::ref::dot_of(ray, ray))) : 0;
        const double allowed = moved + kDepthRoundings * kRounding * depth_terms(scene, sample);
        // Which triangle is there depends on rounding: at an edge, the near plane, of two at a depth.
        const bool unsure = sample.edge < 4 * error * scene.camera.fx / nearest ||
                            sample.behind < z + 4 * allowed ||
                            triangle(sample) != triangle(nearer) ||
                            triangle(sample) != triangle(farther);
        depth.value.push_back(z);
        depth.allowed.push_back(unsure ? kAny * farthest : allowed);
        Vec seen{};
        double turned = 0;
        if (sample.hit) {
            const auto& corners = scene.triangles[sample.hit->triangle];
            const Vec a = splat::ref::difference_of(corners[1], corners[0]);
            const Vec b = splat::ref::difference_of(corners[2], corners[0]);
            const Vec cross = splat::ref::cross_of(a, b);
            const auto length = [](const Vec& v) { return std::sqrt(splat::ref::dot_of(v, v)); };
            seen = scene.camera.turned(sample.hit->normal);
            // The sides of the triangle, each rounded, and vertices that are rounded to 2^-30 of the box.
            const double rounded = 4 * kRounding * length(a) * length(b) +
                                   0x1p-29 * scene.diagonal() * (length(a) + length(b));
            turned = rounded / length(cross) + kNormalRoundings * kRounding;
        }
        for (const double value : seen) {
            normal.value.push_back(value);
            normal.allowed.push_back(unsure ? kAny : turned);
        }
    }
    return {std::move(depth), std::move(normal)};
}

struct Maps {
    std::vector<float> depth = std::vector<float>(std::size_t{kColumns} * kRows);
    std::vector<float> normal = std::vector<float>(std::size_t{kColumns} * kRows * 3);
};

Maps drawn_maps(splat_device device, const TriangleScene& scene) {
    std::vector<double> vertices;
    std::vector<std::uint32_t> indices;
    for (const auto& triangle : scene.triangles)
        for (const Vec& corner : triangle) {
            vertices.insert(vertices.end(), corner.begin(), corner.end());
            indices.push_back(static_cast<std::uint32_t>(indices.size()));
        }
    auto desc = sized<splat_mesh_desc>();
    desc.vertices = vertices.data();
    desc.vertex_count = vertices.size();
    desc.triangles = indices.data();
    desc.triangle_count = indices.size();
    Mesh mesh;
    check(splat_mesh_create(&desc, mesh.out()));
    splat_camera camera{kColumns,        kRows, scene.camera.fx, scene.camera.fy, scene.camera.cx,
                        scene.camera.cy, {}};
    std::copy(scene.camera.world_to_camera.begin(), scene.camera.world_to_camera.end(),
              camera.world_to_camera);
    Maps maps;
    splat_mesh_maps to{};
    to.depth = {maps.depth.data(), 0, SPLAT_PIXEL_F32, kColumns, kRows, 1, 0, 0, 0};
    to.normal = {maps.normal.data(), 0, SPLAT_PIXEL_F32, kColumns, kRows, 3, 0, 0, 0};
    check(splat_mesh_render(mesh.get(), device, &camera, 1, nullptr, &to));
    return maps;
}

}  // namespace

void stress_triangles(Run& run) {
    for (const TriangleStress& stress : triangle_families(run.quick())) {
        if (!run.wants(stress.name)) continue;
        const auto [depth, normal] = expected_maps(stress.scene);
        for (const KernelDevice& with : run.devices())
            run.unless_refused("raster/" + stress.name + ", " + with.kernels, [&] {
                Maps first = drawn_maps(with.device.get(), stress.scene);
                const Maps again = drawn_maps(with.device.get(), stress.scene);
                const auto row = [&](const char* result) {
                    return Row{"raster", stress.name,  stress.input,
                               result,   with.kernels, kTriangleReason};
                };
                run.add(row("depth"), std::move(first.depth), again.depth, depth);
                run.add(row("normal"), std::move(first.normal), again.normal, normal);
            });
    }
}

}  // namespace vkrun::stress
