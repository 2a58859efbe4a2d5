// vkrun priors points: how far a scene's Gaussians lie from the points of a mesh or of a depth map.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>
#include <memory>
#include <numbers>
#include <optional>

#include "core/os/path.h"
#include "vkrun/cli/command.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/options.h"
#include "vkrun/cli/text.h"
#include "vkrun/scene/camera_file.h"
#include "vkrun/scene/scene_file.h"

namespace vkrun {
namespace {

constexpr const char* kPriorsPointsFooter =
    R"(TRUTH is a mesh (.obj), of whose surface N points are drawn, uniformly by area, points (.ply without faces), or a
depth map: .npy or .pfm of distances along the camera's axis in the scene's units, 0 where there is no surface. Its
camera is number V of --camera (transforms.json or a COLMAP model), else one at the origin that looks along z, --fov
wide, as that of the picture of a predicted scene.

--pose brings SCENE from the frame of its picture's camera to that of the mesh: 16 numbers, row by row, of the
camera's place in that world (OpenCV's axes), as SRN's pose files have them: a rotation and a place, the last row
0 0 0 1.

accuracy is the mean distance from Gaussians to the nearest true point, completeness that from true points to the
nearest Gaussian, and chamfer the mean of both; the F-score is the harmonic mean of the shares that are nearer than
the threshold.

Exit status: 0 done, 2 wrong usage, 4 a file cannot be read or is damaged.

Examples:
  vkrun priors points out/scene.ply car.obj --pose cars/rgb/pose/000064.txt
  vkrun priors points out/scene.ply depth.npy --fov 52 --threshold 0.02 --json
)";

constexpr std::uintmax_t kVertexBytes = 6;  ///< the least of a vertex in a .ply file: "0 0 0"

struct PointsOptions {
    std::string scene, truth, camera, pose;
    std::uint32_t view = 0, samples = 100000;
    std::uint64_t seed = 0;
    std::optional<double> fov;        ///< degrees
    std::optional<double> threshold;  ///< scene units
    double min_opacity = 1.0 / 255;
    bool json = false;
};

/// The number of vertices that the header of a .ply file gives; 0: none, which reading it tells.
std::size_t vertices_of(const std::string& path) {
    std::ifstream file = open_to_read(path);
    for (std::string line; std::getline(file, line) && line.rfind("end_header", 0) != 0;) {
        unsigned long long count = 0;
        if (std::sscanf(line.c_str(), "element vertex %llu", &count) != 1) continue;
        if (count > std::filesystem::file_size(splat::os::path_of(path)) / kVertexBytes)
            throw Failure(
                kBadData,
                format("'%s': the header names %llu vertices, more than the file has bytes for",
                       path.c_str(), count));
        return static_cast<std::size_t>(count);
    }
    return 0;
}

std::vector<float> file_points(const PointsOptions& options) {
    const std::size_t count =
        extension_of(options.truth) == ".ply" ? vertices_of(options.truth) : options.samples;
    std::vector<float> points(3 * std::max<std::size_t>(count, 1));
    check(splat_points_from_mesh(options.truth.c_str(), options.seed, points.data(), points.size()),
          kBadData);
    return points;
}

splat_camera camera_of(const PointsOptions& options, const splat_image& depth) {
    if (!options.camera.empty()) {
        auto desc = sized<splat_camera_file_desc>();
        desc.width = depth.width;
        desc.height = depth.height;
        std::uint32_t count = 0;
        try {
            check(splat_camera_load(options.camera.c_str(), &desc, nullptr, 0, &count), kBadData);
        } catch (const Failure& failure) {
            throw with_lens_option(failure, "");  // a distorted map has no other points
        }
        if (options.view >= count)
            throw Failure(kUsageError,
                          format("--view is %u, but '%s' has %u cameras, counted from 0",
                                 options.view, options.camera.c_str(), count));
        std::vector<splat_camera> cameras(count);
        check(splat_camera_load(options.camera.c_str(), &desc, cameras.data(), count, nullptr),
              kBadData);
        return cameras[options.view];
    }
    if (!options.fov) throw Failure(kUsageError, "a depth map needs --camera or --fov");
    splat_camera camera{};
    check(splat_camera_from_fov(depth.width, depth.height, *options.fov * std::numbers::pi / 180,
                                &camera));
    return camera;
}

/// Throws a usage Failure for what is no truth.
void check_truth(const std::string& path) {
    for (const char* extension : {".obj", ".ply", ".npy", ".pfm"})
        if (extension_of(path) == extension) return;
    std::string remedy;
    for (const char* extension : {".stl", ".glb", ".gltf", ".off", ".dae"})
        if (extension_of(path) == extension)
            remedy = "; convert it: python3 -c \"import trimesh; trimesh.load('" + path +
                     "', force='mesh').export('truth.obj')\"";
    throw Failure(kUsageError, "'" + path +
                                   "' is neither a mesh (.obj) nor points (.ply) nor a depth map "
                                   "(.npy, .pfm)" +
                                   remedy);
}

std::vector<float> depth_points(const PointsOptions& options) {
    splat_image depth{};
    depth.type = SPLAT_PIXEL_F32;
    check(splat_image_load(options.truth.c_str(), &depth, nullptr), kBadData);
    if (depth.channels != 1)
        throw Failure(kBadData, format("'%s' has %u channels, expected one of distances",
                                       options.truth.c_str(), depth.channels));
    std::vector<float> values(std::size_t{depth.width} * depth.height);
    depth.pixels = values.data();
    check(splat_image_load(options.truth.c_str(), &depth, nullptr), kBadData);
    const splat_camera camera = camera_of(options, depth);
    std::vector<float> points(3 * values.size());
    std::uint64_t needed = 0;
    check(splat_points_from_depth(&depth, &camera, points.data(), points.size(), &needed),
          kBadData);
    if (needed == 0) throw Failure(kBadData, "'" + options.truth + "' shows no point");
    points.resize(needed);
    return points;
}

/// Throws a Failure of bad data unless `turn` turns without scaling or mirroring.
void check_rotation(const std::string& path, const glm::dmat3& turn) {
    constexpr double kTolerance = 1e-3;
    const glm::dmat3 products = turn * glm::transpose(turn);
    for (int i = 0; i < 3; ++i)
        for (int j = 0; j <= i; ++j) {
            const int expected = i == j ? 1 : 0;
            if (!(std::abs(products[i][j] - expected) <= kTolerance))
                throw Failure(
                    kBadData,
                    format("'%s' is no pose: the product of rows %d and %d of its "
                           "rotation is %g, expected %d within %g",
                           path.c_str(), j + 1, i + 1, products[i][j], expected, kTolerance));
        }
    if (glm::determinant(turn) < 0)
        throw Failure(kBadData, "'" + path +
                                    "' is no pose: the determinant of its rotation is -1, "
                                    "expected 1; an axis is mirrored");
}

/// The numbers of a pose. Throws a Failure of bad data.
std::vector<double> load_pose(const std::string& path) {
    std::ifstream file(splat::os::path_of(path));
    std::vector<double> pose;
    for (std::string word; file >> word;) {
        char* end = nullptr;
        pose.push_back(std::strtod(word.c_str(), &end));
        if (*end != '\0')
            throw Failure(kBadData, format("'%s' holds '%s', expected the 16 numbers of a pose",
                                           path.c_str(), word.c_str()));
    }
    if (pose.size() != 16)
        throw Failure(kBadData, format("'%s' holds %zu numbers, expected the 16 of a pose",
                                       path.c_str(), pose.size()));
    if (pose[12] != 0 || pose[13] != 0 || pose[14] != 0 || pose[15] != 1)
        throw Failure(kBadData, format("'%s' is no pose: its last row is %g %g %g %g, expected "
                                       "0 0 0 1",
                                       path.c_str(), pose[12], pose[13], pose[14], pose[15]));
    return pose;
}

void move_to_world(const std::string& path, splat_scene scene) {
    const std::vector<double> pose = load_pose(path);
    const glm::dmat3 turn = glm::transpose(glm::dmat3(glm::make_mat4(pose.data())));
    check_rotation(path, turn);
    const glm::dquat q = glm::quat_cast(turn);
    const splat_similarity to_world = {{q.w, q.x, q.y, q.z}, {pose[3], pose[7], pose[11]}, 1};
    check(splat_scene_transform(scene, &to_world), kBadData);
}

/// A hundredth of the diagonal of the box around the points.
double default_threshold(const std::vector<float>& points) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        float low = points[axis], high = points[axis];
        for (std::size_t i = axis; i < points.size(); i += 3) {
            low = std::min(low, points[i]);
            high = std::max(high, points[i]);
        }
        const double side = static_cast<double>(high) - static_cast<double>(low);
        squared += side * side;
    }
    return std::sqrt(squared) / 100;
}

void print_scores(const PointsOptions& options, const splat_point_scores& s, std::size_t points,
                  double threshold) {
    if (options.json) {
        print_json({{"scene", options.scene},
                    {"truth", options.truth},
                    {"gaussians", s.gaussians},
                    {"points", points},
                    {"threshold", threshold},
                    {"accuracy", s.accuracy},
                    {"completeness", s.completeness},
                    {"chamfer", s.chamfer},
                    {"chamfer_squared", s.chamfer_squared},
                    {"precision", s.precision},
                    {"recall", s.recall},
                    {"f_score", s.f_score}});
        return;
    }
    std::printf("%llu Gaussians of '%s' against %zu points of '%s'\n",
                static_cast<unsigned long long>(s.gaussians), options.scene.c_str(), points,
                options.truth.c_str());
    std::printf("chamfer %.6g (accuracy %.6g, completeness %.6g; sum of squares %.6g)\n", s.chamfer,
                s.accuracy, s.completeness, s.chamfer_squared);
    std::printf("F-score %.4f at %.4g (precision %.4f, recall %.4f)\n", s.f_score, threshold,
                s.precision, s.recall);
}

int compare_points(const CLI::App& command, const PointsOptions& options) {
    check_truth(options.truth);
    const bool mesh = extension_of(options.truth) == ".obj";
    const bool placed = mesh || extension_of(options.truth) == ".ply";
    if (placed && (!options.camera.empty() || options.fov))
        throw Failure(kUsageError, "--camera and --fov are of depth maps, not of a mesh or points");
    for (const char* name : {"--samples", "--seed"})
        if (!mesh && command.count(name) != 0)
            throw Failure(kUsageError,
                          std::string(name) + " is of a mesh, not of points or depth maps");
    if (options.camera.empty() && command.count("--view") != 0)
        throw Failure(kUsageError, "--view is of the file of --camera, which is not given");
    if (!options.camera.empty() && options.fov)
        throw Failure(kUsageError, "--camera and --fov exclude each other");
    if (options.fov) check_number("--fov", *options.fov, 0.1, 179);
    if (options.threshold) check_number("--threshold", *options.threshold, 1e-12, 1e12);
    check_number("--min-opacity", options.min_opacity, 0, 1);
    SceneFile scene = load_scene(options.scene);
    if (!options.pose.empty()) move_to_world(options.pose, scene.scene.get());
    const std::vector<float> points = placed ? file_points(options) : depth_points(options);
    const double threshold = options.threshold ? *options.threshold : default_threshold(points);
    auto scores = sized<splat_point_scores>();
    check(splat_scene_compare_points(scene.scene.get(), options.min_opacity, points.data(),
                                     points.size(), threshold, &scores),
          kBadData);
    print_scores(options, scores, points.size() / 3, threshold);
    return kSuccess;
}

}  // namespace

void add_priors_points(CLI::App& priors, int& exit_code) {
    CLI::App* command = add_command(
        priors, "points", "Compare a scene with a mesh or a depth map: Chamfer distance, F-score.",
        kPriorsPointsFooter);
    const auto options = std::make_shared<PointsOptions>();
    PointsOptions& o = *options;
    command->add_option("SCENE", o.scene, "Scene file")->required()->type_name("");
    command->add_option("TRUTH", o.truth, "Mesh (.obj), points (.ply) or depth map (.npy, .pfm)")
        ->required()
        ->type_name("");
    command->add_option("--pose", o.pose, "Pose of the camera whose frame the scene has")
        ->type_name("FILE");
    command->add_option("--camera", o.camera, "Cameras of the depth map")->type_name("FILE");
    command->add_option("--view", o.view, "Number of its camera in that file, from 0")
        ->type_name("V")
        ->capture_default_str();
    command->add_option("--fov", o.fov, "Degrees across the depth map, without --camera")
        ->type_name("DEG");
    add_count_option(*command, "--samples", o.samples, "Points of the mesh", 1, 10000000);
    command->add_option("--seed", o.seed, "Seed of these points")
        ->type_name("N")
        ->capture_default_str();
    command
        ->add_option("--threshold", o.threshold,
                     "Distance of the F-score; default: 1 % of the diagonal of the truth's box")
        ->type_name("X");
    command->add_option("--min-opacity", o.min_opacity, "Least opacity of Gaussians that count")
        ->type_name("X")
        ->default_str("1/255");
    add_json_flag(*command, o.json);
    command->callback(
        [command, options, &exit_code] { exit_code = compare_points(*command, *options); });
}

}  // namespace vkrun
