#include "io/colmap_lens.h"

#include "io/reader.h"
#include "scene/camera_pose.h"

namespace splat::io::colmap {
namespace {

constexpr const char* kRadial1[] = {"k"};
constexpr const char* kRadial2[] = {"k1", "k2"};
constexpr const char* kOpenCv[] = {"k1", "k2", "p1", "p2"};
constexpr const char* kFullOpenCv[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};

constexpr Model kModels[] = {
    {0, "SIMPLE_PINHOLE", 3, true, false, {}},         {1, "PINHOLE", 4, false, false, {}},
    {2, "SIMPLE_RADIAL", 4, true, false, kRadial1},    {3, "RADIAL", 5, true, false, kRadial2},
    {4, "OPENCV", 8, false, false, kOpenCv},           {5, "OPENCV_FISHEYE", 8, false, true, {}},
    {6, "FULL_OPENCV", 12, false, false, kFullOpenCv}, {7, "FOV", 5, false, true, {}},
    {8, "SIMPLE_RADIAL_FISHEYE", 4, true, true, {}},   {9, "RADIAL_FISHEYE", 5, true, true, {}},
    {10, "THIN_PRISM_FISHEYE", 12, false, true, {}}};

}  // namespace

const Model* find_model(std::int32_t id) {
    for (const Model& model : kModels)
        if (model.id == id) return &model;
    return nullptr;
}

const Model* find_model(std::string_view name) {
    for (const Model& model : kModels)
        if (model.name == name) return &model;
    return nullptr;
}

std::string supported_models() {
    std::string list;
    for (const Model& model : kModels) list += (list.empty() ? "" : ", ") + std::string(model.name);
    return list;
}

Status add_camera(const Lenses& lenses, const Pose& pose, const CameraOptions& options,
                  CameraSet& set) {
    const auto found = lenses.find(pose.camera);
    if (found == lenses.end())
        return error(Code::kFormat, "COLMAP: image '%s' names camera %llu, which does not exist",
                     shown(pose.name).c_str(), static_cast<unsigned long long>(pose.camera));
    if (set.cameras.size() >= options.max_cameras)
        return error(Code::kUnsupported, "COLMAP: more than %llu images",
                     static_cast<unsigned long long>(options.max_cameras));
    const Lens& lens = found->second;
    const std::vector<double>& p = lens.parameters;
    if (lens.width > scene::kMaxImageSide || lens.height > scene::kMaxImageSide)
        return error(Code::kFormat, "COLMAP: camera %llu of %llu x %llu pixels",
                     static_cast<unsigned long long>(pose.camera),
                     static_cast<unsigned long long>(lens.width),
                     static_cast<unsigned long long>(lens.height));
    const std::size_t center = lens.model->one_focal ? 1 : 2;
    scene::Camera camera;
    camera.name = pose.name;
    camera.width = static_cast<std::uint32_t>(lens.width);
    camera.height = static_cast<std::uint32_t>(lens.height);
    camera.fx = p[0];
    camera.fy = lens.model->one_focal ? p[0] : p[1];
    camera.cx = p[center];
    camera.cy = p[center + 1];
    if (lens.model->other_lens)
        SPLAT_TRY(note_lens(pose.name, "model", "camera model " + std::string(lens.model->name),
                            options, set));
    for (std::size_t i = 0; i < lens.model->distortion.size(); ++i)
        SPLAT_TRY(
            note_distortion(pose.name, lens.model->distortion[i], p[center + 2 + i], options, set));
    const auto matrix = scene::pose_from_quaternion(
        {pose.rotation[0], pose.rotation[1], pose.rotation[2], pose.rotation[3]},
        {pose.translation[0], pose.translation[1], pose.translation[2]});
    if (!matrix.ok())
        return error(Code::kFormat, "COLMAP: image '%s': %s", shown(pose.name).c_str(),
                     matrix.status().message().c_str());
    camera.world_to_camera = matrix.value();
    SPLAT_TRY(from_file(scene::check_camera(camera)));
    set.cameras.push_back(std::move(camera));
    return {};
}

}  // namespace splat::io::colmap

namespace splat::io {

Status note_lens(const std::string& camera, const std::string& kind, const std::string& what,
                 const CameraOptions& options, CameraSet& set) {
    if (!options.ignore_distortion)
        return error(Code::kUnsupported,
                     "camera '%s': %s, only pinhole cameras are supported: undistort the images "
                     "('colmap image_undistorter' makes images and cameras of a COLMAP model)%s",
                     shown(camera).c_str(), what.c_str(),
                     options.may_ignore ? ", or ignore it (SPLAT_CAMERA_IGNORE_DISTORTION)" : "");
    IgnoredLens& ignored =
        set.ignored.try_emplace(kind, IgnoredLens{what, camera, {}}).first->second;
    ignored.cameras.insert(set.cameras.size());
    return {};
}

Status note_distortion(const std::string& camera, const char* parameter, double value,
                       const CameraOptions& options, CameraSet& set) {
    if (value == 0) return {};
    return note_lens(camera, parameter, format("distortion %s = %g", parameter, value), options,
                     set);
}

void warn_of_ignored(CameraSet& set) {
    if (set.ignored.empty()) return;
    std::set<std::size_t> cameras;
    std::string what;
    for (const auto& [kind, ignored] : set.ignored) {
        cameras.insert(ignored.cameras.begin(), ignored.cameras.end());
        what += (what.empty() ? "" : ", ") + ignored.what;
    }
    const std::string first = shown(set.ignored.begin()->second.camera);
    set.warnings.push_back(cameras.size() == 1
                               ? format("camera '%s': %s is ignored", first.c_str(), what.c_str())
                               : format("%zu cameras, such as '%s': %s is ignored", cameras.size(),
                                        first.c_str(), what.c_str()));
}

}  // namespace splat::io
