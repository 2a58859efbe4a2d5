#include "data/folder.h"

#include <algorithm>
#include <cmath>

#include "core/os/path.h"
#include "io/file.h"
#include "io/photo/image_file.h"
#include "scene/camera_pose.h"

namespace splat::data {

namespace fs = std::filesystem;

namespace {

/// Names of the entries for which `wanted` is true.
Result<std::vector<std::string>> names_in(const fs::path& folder,
                                          bool (*wanted)(const fs::path&, const std::string&),
                                          const std::string& argument) {
    const auto entries = io::entries_in(os::text_of(folder));
    if (entries.status().code() == Code::kNotFound) return std::vector<std::string>();
    if (!entries.ok()) return entries.status();
    std::vector<std::string> names;
    for (const io::FolderEntry& entry : entries.value())
        if (wanted(os::path_of(entry.name), argument)) names.push_back(entry.name);
    return names;
}

}  // namespace

Result<std::vector<std::string>> stems_in(const fs::path& folder, const std::string& extension) {
    const auto has_extension = [](const fs::path& name, const std::string& wanted) {
        return os::text_of(name.extension()) == wanted;
    };
    SPLAT_ASSIGN(std::vector<std::string> names, names_in(folder, has_extension, extension));
    for (std::string& name : names) name.resize(name.size() - extension.size());
    return names;
}

Status as_damage(const Status& status) {
    return status.code() == Code::kNotFound ? Status(Code::kFormat, status.message()) : status;
}

Status check_link(io::PathKind kind, const fs::path& path) {
    if (kind != io::PathKind::kBrokenLink) return {};
    return damaged("'%s' is a link to what does not exist", os::text_of(path).c_str());
}

Status check_split(const std::string& split) {
    if (split == "train" || split == "val" || split == "test") return {};
    return invalid("split is '%s', expected train, val or test", split.c_str());
}

Result<std::vector<std::string>> images_in(const fs::path& folder) {
    const auto is_image = [](const fs::path& name, const std::string& /*none*/) {
        return io::is_image_name(os::text_of(name));
    };
    return names_in(folder, is_image, {});
}

Result<std::vector<std::string>> candidates_in(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<io::FolderEntry> entries, io::entries_in(os::text_of(folder)));
    std::vector<std::string> names;
    for (const io::FolderEntry& entry : entries)
        if (entry.kind == io::PathKind::kFolder || entry.kind == io::PathKind::kBrokenLink)
            names.push_back(entry.name);
    return names;
}

Result<scene::Mat4> affine(std::span<const float> values) {
    if (values.size() != 12 && values.size() != 16)
        return damaged("a pose of %zu numbers, expected 3 x 4 or 4 x 4", values.size());
    scene::Mat4 pose{};
    std::ranges::copy(values, pose.begin());
    pose[15] = 1;
    return pose;
}

Result<scene::Mat4> inverse_pose(const scene::Mat4& pose) {
    SPLAT_TRY(check_pose(pose, "pose"));
    return scene::inverse_pose(pose);
}

Result<io::Image> load_square(const fs::path& path, bool header_only) {
    return load_bytes(path, {.square = true, .header_only = header_only});
}

Result<io::Image> load_bytes(const fs::path& path, const io::ImageOptions& options) {
    SPLAT_ASSIGN(io::Image found, io::load_image(os::text_of(path), options));
    return reduced_to_bytes(std::move(found));
}

io::Image reduced_to_bytes(io::Image image) {
    if (image.bits == 16)
        for (std::uint16_t& sample : image.samples)
            sample = static_cast<std::uint16_t>((sample * 255U + 32767U) / 65535U);
    image.bits = 8;
    return image;
}

Status check_pose(const scene::Mat4& camera_to_world, const std::string& place) {
    scene::Camera camera{place, 1, 1, 1, 1, 0.5, 0.5, camera_to_world};
    SPLAT_TRY(io::from_file(scene::check_camera(camera)));
    const auto& m = camera_to_world;
    const double distance = std::hypot(m[3], m[7], m[11]);
    if (distance <= kMostDistance) return {};
    return damaged(
        "camera '%s': the camera is %g from the origin, expected at most %g; is the file damaged?",
        place.c_str(), distance, kMostDistance);
}

}  // namespace splat::data
