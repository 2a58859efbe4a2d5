#include "data/co3d_cameras.h"

#include <algorithm>
#include <cmath>

#include "data/folder.h"
#include "io/file.h"
#include "io/ply_rows.h"

namespace splat::data {
namespace {

using scene::Mat3;
using scene::Vec3;

constexpr double kExtent = 1.2 * 0.95 / 2;  ///< most distance of the points from the origin
constexpr int kSweeps = 30;                 ///< sweeps of Jacobi's method; some 6 are enough

/// Column i of R is axis i of the camera in the world.
Mat3 rotation_of(const RawFrame& frame) {
    return glm::transpose(glm::make_mat3(frame.rotation.data()));
}

/// Eigenvectors of a symmetric matrix, as columns, that of the greatest eigenvalue first. Jacobi's method.
Mat3 eigenvectors(Mat3 a) {
    constexpr std::pair<std::size_t, std::size_t> kPairs[] = {{0, 1}, {0, 2}, {1, 2}};
    Mat3 v(1);
    for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (const auto& [p, q] : kPairs) {
            if (a[p][q] == 0) continue;
            const double angle = 0.5 * std::atan2(2 * a[p][q], a[p][p] - a[q][q]);
            const double c = std::cos(angle), s = std::sin(angle);
            const auto rotate = [c, s](double& x, double& y) {
                const double old = x;
                x = c * old + s * y;
                y = c * y - s * old;
            };
            for (std::size_t k = 0; k < 3; ++k) rotate(a[k][p], a[k][q]);
            for (std::size_t k = 0; k < 3; ++k) rotate(a[p][k], a[q][k]);
            for (std::size_t k = 0; k < 3; ++k) rotate(v[p][k], v[q][k]);
        }
    std::array<std::size_t, 3> order = {0, 1, 2};
    std::ranges::sort(order, [&a](std::size_t i, std::size_t j) { return a[i][i] > a[j][j]; });
    return {v[order[0]], v[order[1]], v[order[2]]};
}

/// Columns: the new x, y and z axes in the old world.
Mat3 upright_axes(std::span<const Mat3> rotations) {
    Vec3 mean{};
    for (const Mat3& r : rotations) mean += r[0] * (1.0 / static_cast<double>(rotations.size()));
    Mat3 scatter{};
    for (const Mat3& r : rotations) {
        const Vec3 d = r[0] - mean;
        scatter += glm::outerProduct(d, d);
    }
    const Mat3 found = eigenvectors(scatter);
    Vec3 across = found[0], up = found[2];
    if (glm::dot(up, rotations[0][1]) < 0) up = -up;
    const auto greatest = std::max({across.x, across.y, across.z},
                                   [](double a, double b) { return std::abs(a) < std::abs(b); });
    if (greatest < 0) across = -across;
    return {across, up, glm::cross(across, up)};
}

Co3dCameras cameras_from(std::span<const Mat3> rotations, std::span<const Vec3> translations) {
    Co3dCameras cameras;
    for (const Mat3& r : rotations)
        for (std::size_t i = 0; i < 9; ++i)
            cameras.rotations.push_back(static_cast<float>(r[i % 3][i / 3]));
    for (const Vec3& t : translations)
        for (std::size_t k = 0; k < 3; ++k)
            cameras.translations.push_back(static_cast<float>(t[k]));
    return cameras;
}

}  // namespace

Co3dCameras stored_cameras(std::span<const RawFrame> frames) {
    std::vector<Mat3> rotations;
    std::vector<Vec3> translations;
    for (const RawFrame& frame : frames) {
        rotations.push_back(rotation_of(frame));
        translations.emplace_back(glm::make_vec3(frame.translation.data()));
    }
    return cameras_from(rotations, translations);
}

Result<Co3dCameras> normalised_cameras(std::span<const RawFrame> frames,
                                       std::span<const Vec3> points) {
    if (frames.size() < 2 || points.empty())
        return damaged("%zu cameras and %zu points, expected 2 or more and some", frames.size(),
                       points.size());
    Vec3 center{};
    for (const Vec3& point : points) center += point * (1.0 / static_cast<double>(points.size()));
    std::vector<Mat3> rotations;
    for (const RawFrame& frame : frames) rotations.push_back(rotation_of(frame));
    const Mat3 axes = upright_axes(rotations);
    double low = 0, high = 0;
    std::vector<Vec3> turned;
    for (const Vec3& point : points) {
        turned.push_back((point - center) * axes);
        low = std::min(low, turned.back()[1]);
        high = std::max(high, turned.back()[1]);
    }
    const Vec3 middle = {0, high - (high - low) / 2, 0};
    double extent = 0;
    for (const Vec3& point : turned) {
        const Vec3 far = glm::abs(point - middle);
        extent = std::max({extent, far.x, far.y, far.z});
    }
    if (!(extent > 0) || !std::isfinite(extent)) return damaged("the points have no extent");
    std::vector<Vec3> translations;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        const Vec3 given = glm::make_vec3(frames[i].translation.data());
        const Vec3 shifted = center * rotations[i] + given;
        rotations[i] = glm::transpose(axes) * rotations[i];
        translations.push_back((middle * rotations[i] + shifted) * (kExtent / extent));
    }
    return cameras_from(rotations, translations);
}

Result<std::vector<Vec3>> read_points(const std::string& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path));
    const auto header = io::parse_ply_header(file);
    if (!header.ok()) return in_file(header.status(), path);
    std::vector<Vec3> points;
    io::PlyRows rows(header.value(), file);
    for (const io::PlyElement& element : header.value().elements) {
        if (element.name != "vertex") {
            const Status skipped = rows.skip(element);
            if (!skipped.ok()) return in_file(skipped, path);
            continue;
        }
        const auto x = element.find("x"), y = element.find("y"), z = element.find("z");
        if (!x || !y || !z) break;
        const Status read = rows.read(element, [&](std::size_t, const std::vector<double>& row) {
            points.push_back({row[*x], row[*y], row[*z]});
        });
        if (!read.ok()) return in_file(read, path);
        break;
    }
    if (!points.empty()) return points;
    return damaged("'%s' has no vertices with x, y and z", path.c_str());
}

}  // namespace splat::data
