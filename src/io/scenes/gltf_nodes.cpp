// Nodes: where the scene of a glTF file has its meshes, and what their transforms do to Gaussians.

#include <algorithm>
#include <cmath>

#include "io/reader.h"
#include "io/scenes/gltf.h"
#include "scene/arrays.h"
#include "scene/sh.h"
#include "scene/transform.h"

namespace splat::io::gltf {
namespace {

using scene::Mat3;
using scene::Quaternion;
using scene::Vec3;

/// The node's own transform, with those of the nodes above, which `at` has.
Status enter(const JsonTree& node, const std::string& where, Placement& at) {
    Mat3 linear(1);
    Vec3 move{};
    if (node.find("matrix") != nullptr) {
        double m[16];  // column by column
        SPLAT_TRY(read_numbers(node["matrix"], m, 16, "matrix", where));
        for (const char* const other : {"translation", "rotation", "scale"})
            if (node.find(other) != nullptr)
                return damaged("gltf: %s: a matrix and a %s, expected one of them", where.c_str(),
                               other);
        if (m[3] != 0 || m[7] != 0 || m[11] != 0 || m[15] != 1)
            return damaged(
                "gltf: %s: the last row of its matrix is %g, %g, %g, %g, expected 0, 0, 0, 1",
                where.c_str(), m[3], m[7], m[11], m[15]);
        for (std::size_t column = 0; column < 3; ++column)
            linear[column] = glm::make_vec3(m + 4 * column);
        move = glm::make_vec3(m + 12);
    } else {
        double rotation[4] = {0, 0, 0, 1};  // x, y, z, w
        double scale[3] = {1, 1, 1};
        if (node.find("translation") != nullptr)
            SPLAT_TRY(read_numbers(node["translation"], &move.x, 3, "translation", where));
        if (node.find("rotation") != nullptr)
            SPLAT_TRY(read_numbers(node["rotation"], rotation, 4, "rotation", where));
        if (node.find("scale") != nullptr)
            SPLAT_TRY(read_numbers(node["scale"], scale, 3, "scale", where));
        const Quaternion q(rotation[3], rotation[0], rotation[1], rotation[2]);
        const double length = scene::length_of(q);
        if (!(std::abs(length - 1) < 0.01))
            return damaged("gltf: %s: a rotation of length %g, expected 1", where.c_str(), length);
        linear = glm::mat3_cast(q / length);
        for (std::size_t column = 0; column < 3; ++column) linear[column] *= scale[column];
    }
    at.move += at.linear * move;
    at.linear = at.linear * linear;
    return {};
}

/// Indices of root nodes: those of the scene that is shown first.
Result<const JsonTree*> roots_of(const Document& document, std::set<std::string>& ignored) {
    const JsonTree& json = document.json();
    const std::size_t scenes = json["scenes"].items().size();
    if (scenes == 0) return damaged("gltf: there is no scene; expected one that names nodes");
    SPLAT_ASSIGN(const std::uint64_t shown, whole_number(json, "scene", "the document", 0));
    SPLAT_ASSIGN(const JsonTree* const scene, document.element("scenes", shown));
    if (scenes > 1) ignored.insert(format("%zu scenes that are not shown first", scenes - 1));
    return &(*scene)["nodes"];
}

/// What a node does to shapes.
struct Shape {
    Mat3 rotation{1};
    double scale = 1;
    bool similar = false;  ///< one scale for all axes, no shear
};

/// Both within what float32 gives matrices.
constexpr double kSameScale = 1e-6, kNoShear = 1e-12;
/// The extension has "close to one" for the determinant of the unit columns: an angle of 1.4e-3.
constexpr double kLittleShear = 1e-6;

Result<Shape> shape_of(const Placement& placement) {
    double lengths[3];
    Mat3 unit = placement.linear;
    for (std::size_t k = 0; k < 3; ++k) {
        lengths[k] = glm::length(unit[k]);
        unit[k] /= lengths[k];
        if (!std::isfinite(lengths[k]) || !(lengths[k] > 0))
            return damaged(
                "gltf: nodes[%llu] scales an axis of its mesh by %g, expected a number > 0",
                llu(placement.node), lengths[k]);
    }
    const double determinant = glm::determinant(unit);
    if (!(determinant > 1 - kLittleShear))
        return unsupported(
            "gltf: nodes[%llu] %s its mesh (the unit columns of its matrix have the determinant "
            "%g, expected 1), for which %s defines no drawing; change the node's transform, or "
            "those above it",
            llu(placement.node), determinant < 0 ? "mirrors" : "shears", determinant, kExtension);
    Shape shape;
    shape.rotation = glm::mat3_cast(glm::normalize(glm::quat_cast(unit)));
    const auto [least, most] = std::minmax({lengths[0], lengths[1], lengths[2]});
    shape.similar = most <= least * (1 + kSameScale) && determinant > 1 - kNoShear;
    shape.scale = std::cbrt(lengths[0] * lengths[1] * lengths[2]);
    return shape;
}

/// Makes the columns orthogonal by rotating pairs of them: m = U S V^T, and m V is left. Columns of very different
/// lengths keep their relative precision, unlike with the eigenvectors of m m^T. Source: Hestenes 1958.
void orthogonalise(Mat3& m) {
    constexpr int kMostSweeps = 30;
    constexpr double kOrthogonal = 1e-15;
    bool turned = true;
    for (int sweep = 0; turned && sweep < kMostSweeps; ++sweep) {
        turned = false;
        for (const auto& [p, q] : {std::pair{0, 1}, {0, 2}, {1, 2}}) {
            Vec3& x = m[static_cast<std::size_t>(p)];
            Vec3& y = m[static_cast<std::size_t>(q)];
            const double inner = glm::dot(x, y);
            if (!(std::abs(inner) > kOrthogonal * glm::length(x) * glm::length(y))) continue;
            const double zeta = (glm::dot(y, y) - glm::dot(x, x)) / (2 * inner);
            const double tangent =
                std::copysign(1 / (std::abs(zeta) + std::hypot(1.0, zeta)), zeta);
            const double cosine = 1 / std::hypot(1.0, tangent);
            const Vec3 old = x;
            x = cosine * (old - tangent * y);
            y = cosine * (tangent * old + y);
            turned = true;
        }
    }
}

/// The rotation and scales of the covariance M C C^T M^T. Values that are not numbers stay.
void stretch_shape(scene::Gaussians& g, std::size_t i, const Mat3& linear) {
    constexpr double kLeast = 1e-150;  ///< stands for a scale of 0, whose direction counts
    float* const logs = &g.log_scales[3 * i];
    const Quaternion q = scene::rotation_at(g, i);
    const double length = scene::length_of(q);
    if (!std::isfinite(length) || length == 0) return;
    Mat3 axes = linear * glm::mat3_cast(q / length);
    for (std::size_t k = 0; k < 3; ++k) {
        const double scale = std::exp(static_cast<double>(logs[k]));
        if (!std::isfinite(scale)) return;
        axes[k] *= std::max(scale, kLeast);
    }
    orthogonalise(axes);
    for (std::size_t k = 0; k < 3; ++k) {
        const double scale = glm::length(axes[k]);
        axes[k] /= scale;
        logs[k] = scale < 1e10 * kLeast ? -INFINITY : static_cast<float>(std::log(scale));
    }
    if (glm::determinant(axes) < 0) axes[0] = -axes[0];  // an axis has no sign
    const glm::quat turned = glm::normalize(glm::quat_cast(axes));
    std::copy_n(&turned.w, 4, &g.rotations[4 * i]);
}

Status stretch(scene::Gaussians& g, const Placement& placement, const Mat3& rotation) {
    const scene::ShTransform bands(rotation);
    const std::size_t each = std::size_t{scene::sh_coefficients(g.sh_degree)} * 3;
    for (std::size_t i = 0; i < g.count(); ++i) {
        const Vec3 mean = glm::make_vec3(&g.means[3 * i]);
        const glm::vec3 moved = placement.linear * mean + placement.move;
        if (scene::is_finite(mean) && !scene::is_finite(moved))
            return damaged("gltf: nodes[%llu] moves Gaussian %zu beyond float32",
                           llu(placement.node), i);
        std::copy_n(glm::value_ptr(moved), 3, &g.means[3 * i]);
        stretch_shape(g, i, placement.linear);
        bands.apply(g.sh.data() + i * each, g.sh_degree);
    }
    return {};
}

}  // namespace

Status read_numbers(const JsonTree& list, double* to, std::size_t count, const char* member,
                    const std::string& where) {
    const JsonTree::List& items = list.items();
    bool good = items.size() == count;
    for (std::size_t i = 0; good && i < count; ++i) {
        to[i] = items[i].number().value_or(NAN);
        good = std::isfinite(to[i]);
    }
    if (good) return {};
    return damaged("gltf: %s: %s is no array of %zu finite numbers", where.c_str(), member, count);
}

Result<std::vector<Placement>> placed_meshes(const Document& document,
                                             std::set<std::string>& ignored) {
    const std::size_t nodes = document.json()["nodes"].items().size();
    std::vector<Placement> placed;
    std::vector<bool> reached(nodes);
    std::vector<Placement> open;  // nodes to enter, with the transforms above them
    const auto add = [&](const JsonTree& children, const Placement& above) -> Status {
        const JsonTree::List& list = children.items();
        for (std::size_t i = list.size(); i-- > 0;) {
            const auto node = list[i].count();
            if (!node || *node >= nodes)
                return damaged("gltf: a node is named that is not there; there are %zu", nodes);
            if (reached[static_cast<std::size_t>(*node)])
                return damaged("gltf: nodes[%llu] is reached twice, expected a tree", llu(*node));
            reached[static_cast<std::size_t>(*node)] = true;
            open.push_back(above);
            open.back().node = *node;
        }
        return {};
    };
    SPLAT_ASSIGN(const JsonTree* const roots, roots_of(document, ignored));
    SPLAT_TRY(add(*roots, {}));
    while (!open.empty()) {
        Placement at = open.back();
        open.pop_back();
        SPLAT_ASSIGN(const JsonTree* const node, document.element("nodes", at.node));
        const std::string where = format("nodes[%llu]", llu(at.node));
        SPLAT_TRY(enter(*node, where, at));
        if (node->find("mesh") != nullptr) {
            SPLAT_SET(at.mesh, whole_number(*node, "mesh", where));
            placed.push_back(at);
        }
        SPLAT_TRY(add((*node)["children"], at));
    }
    return placed;
}

Status place(scene::Gaussians& gaussians, const Placement& placement) {
    if (placement.linear == Mat3(1) && placement.move == Vec3{}) return {};
    SPLAT_ASSIGN(const Shape shape, shape_of(placement));
    if (!shape.similar) return stretch(gaussians, placement, shape.rotation);
    const Status moved =
        scene::transform(gaussians, {glm::quat_cast(shape.rotation), placement.move, shape.scale});
    if (moved.ok()) return {};
    return damaged("gltf: nodes[%llu]: %s", llu(placement.node), moved.message().c_str());
}

}  // namespace splat::io::gltf
