#include "mesh_views/views_desc.h"

#include <array>
#include <numbers>

#include "core/hash.h"
#include "core/json_writer.h"
#include "core/path_name.h"
#include "scene/camera_pose.h"
#include "scene/view_places.h"

namespace splat::mesh_views {
namespace {

constexpr double kFocal = 131.25;  ///< at kFocalSize pixels
constexpr double kFocalSize = 128;
constexpr double kTop = 0.9999;  ///< "up" is undefined at the poles
constexpr double kMostDistance = 1e6;
constexpr std::uint32_t kMostPoints = 10'000'000;
constexpr std::size_t kMostWords = 1000;  ///< bytes

constexpr const char* kProtocols[] = {"sphere", "hemisphere", "orbit"};
constexpr const char* kBackgrounds[] = {"white", "black", "gray", "plain", "gradient"};

template <class Enum>
std::size_t index_of(Enum value) {
    return static_cast<std::size_t>(value);
}

Status check_name(const char* what, const std::string& name) {
    if (!name.empty() && is_name_in_folder(name) && PathName(name).text() == name) return {};
    return invalid(
        "%s is '%s', expected a name that folders of every system may have, such as '%s'", what,
        name.c_str(), PathName(name).text().c_str());
}

Status check_range(const char* what, double value, double least, double most) {
    if (value >= least && value <= most) return {};
    return invalid("%s is %g, expected %g to %g", what, value, least, most);
}

scene::Vec3 direction_of(const ViewsDesc& desc, std::uint32_t view) {
    if (desc.protocol == Protocol::kOrbit)
        return scene::direction_at(std::sin(desc.elevation),
                                   2 * std::numbers::pi * view / desc.views());
    if (desc.split != "train") return scene::spiral_direction(view, desc.views());
    Random random = random_of(desc, Chance::kPlace, view);
    const double least = desc.protocol == Protocol::kSphere ? -kTop : 0;
    const double height = random.between(least, kTop);
    return scene::direction_at(height, random.between(0, 2 * std::numbers::pi));
}

/// Turns by an angle in the plane of two axes, from the first towards the second.
scene::Mat3 turn(std::size_t from, std::size_t to, double angle) {
    scene::Mat3 turned(1);
    turned[from][from] = turned[to][to] = std::cos(angle);
    turned[from][to] = std::sin(angle);
    turned[to][from] = -std::sin(angle);
    return turned;
}

/// The camera rolled and aimed beside its target, which changes its axes and not its place.
scene::Mat4 jittered(const scene::Mat4& pose, double angle, Random& random) {
    const double right = random.between(-angle, angle);
    const double down = random.between(-angle, angle);
    const scene::Mat3 by =
        turn(0, 1, random.between(-angle, angle)) * turn(1, 2, down) * turn(0, 2, right);
    return scene::make_pose(by * scene::rotation_of(pose), by * scene::translation_of(pose));
}

}  // namespace

Status check_desc(const ViewsDesc& desc) {
    if (desc.path.empty()) return invalid("path is empty, expected a folder");
    SPLAT_TRY(check_name("category", desc.category));
    SPLAT_TRY(check_name("name", desc.name));
    if (desc.prepared.size() > kMostWords)
        return invalid("prepared has %zu bytes, expected at most %zu", desc.prepared.size(),
                       kMostWords);
    if (desc.split != "train" && desc.split != "val" && desc.split != "test")
        return invalid("split is '%s', expected train, val or test", desc.split.c_str());
    if (desc.size < 8) return invalid("size is %u, expected 8 to 2048", desc.size);
    if (desc.size > 2048) return unsupported("size is %u, expected 8 to 2048", desc.size);
    for (const std::uint32_t views : {desc.train_views, desc.test_views})
        if (views < 1 || views > 100000)
            return invalid("%u views of an object, expected 1 to 100000", views);
    if (desc.samples != 1 && desc.samples != 2 && desc.samples != 4 && desc.samples != 8)
        return invalid("samples is %u, expected 1, 2, 4 or 8", desc.samples);
    if (desc.points > kMostPoints)
        return invalid("%u points, expected at most %u", desc.points, kMostPoints);
    SPLAT_TRY(check_range("distance", desc.distance, 1e-6, kMostDistance));
    if (desc.fov_x != 0) SPLAT_TRY(check_range("fov_x", desc.fov_x, kDegree, 170 * kDegree));
    SPLAT_TRY(check_range("elevation", desc.elevation, -89 * kDegree, 89 * kDegree));
    SPLAT_TRY(check_range("jitter", desc.jitter, 0, 45 * kDegree));
    return check_range("exposure", desc.exposure, 0, 8);
}

std::string values_text(const ViewsDesc& desc) {
    JsonWriter json;
    json.begin_object().member("made_by", "splat_mesh_write_views").member("version", 1);
    json.member("seed", desc.seed).member("size", desc.size);
    json.member("train_views", desc.train_views).member("test_views", desc.test_views);
    json.member("samples", desc.samples).member("points", desc.points).key("maps").begin_array();
    for (const auto& [wanted, name] : {std::pair(desc.depth, "depth"),
                                       {desc.normal, "normal"},
                                       {desc.mask, "mask"},
                                       {desc.albedo, "albedo"}})
        if (wanted) json.value(name);
    json.end().member("protocol", kProtocols[index_of(desc.protocol)]);
    json.member("background", kBackgrounds[index_of(desc.background)]);
    json.key("distance").number(desc.distance, 9).key("fov_x").number(desc.fov_x, 9);
    json.key("elevation").number(desc.elevation, 9).key("jitter").number(desc.jitter, 9);
    json.key("exposure").number(desc.exposure, 9).member("meshes", desc.prepared).end();
    return json.text() + "\n";
}

std::uint64_t seed_of(const ViewsDesc& desc) {
    Hash hash;
    hash.add_number(desc.seed);
    hash.add(desc.name);
    return hash.value();
}

Random random_of(const ViewsDesc& desc, Chance what, std::uint32_t view) {
    return Random(seed_of(desc), static_cast<std::uint32_t>(what), view, 0);
}

scene::Camera view_camera(const ViewsDesc& desc, std::uint32_t view) {
    scene::Camera camera;
    camera.name = format("%06u", view);
    camera.width = camera.height = desc.size;
    camera.fx = camera.fy = desc.fov_x != 0 ? desc.size / 2.0 / std::tan(desc.fov_x / 2)
                                            : kFocal * desc.size / kFocalSize;
    camera.cx = camera.cy = desc.size / 2.0;
    Random random = random_of(desc, Chance::kJitter, view);
    const double share = desc.jitter / kDegree / 100;
    const double distance = desc.distance * (1 + random.between(-share, share));
    const auto pose = scene::look_at(direction_of(desc, view) * distance, {0, 0, 0}, {0, 0, 1});
    SPLAT_ASSERT(pose.ok());
    camera.world_to_camera =
        desc.jitter > 0 ? jittered(pose.value(), desc.jitter, random) : pose.value();
    return camera;
}

scene::Camera in_mesh_axes(const scene::Camera& camera, Up up) {
    scene::Camera own = camera;
    if (up == Up::kZ) return own;
    for (std::size_t row = 0; row < 3; ++row) {
        double* const m = &own.world_to_camera[4 * row];
        const std::array<double, 3> of_world = {m[0], m[1], m[2]};
        m[2] = of_world[0];
        m[0] = of_world[1];
        m[1] = of_world[2];
    }
    return own;
}

scene::Vec3 in_world(const scene::Vec3& of_mesh, Up up) {
    return up == Up::kZ ? of_mesh : scene::Vec3(of_mesh.z, of_mesh.x, of_mesh.y);
}

}  // namespace splat::mesh_views
