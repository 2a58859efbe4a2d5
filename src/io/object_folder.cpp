#include "io/object_folder.h"

#include <cstdlib>

#include "core/os/path.h"
#include "core/os/process.h"
#include "io/file.h"
#include "io/folder.h"
#include "scene/camera_pose.h"

namespace splat::io {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMostValues = 1U << 16;  ///< bytes

std::string text_of(const double* values, std::size_t count) {
    std::string text;
    for (std::size_t i = 0; i < count; ++i) {
        if (i > 0) text += ' ';
        text += format("%.9g", values[i]);
    }
    return text + "\n";
}

/// Removes folders that killed processes left: ".<name>.<process>-<number>.tmp".
void remove_stale(const fs::path& folder) {
    std::error_code code;
    const std::string prefix = "." + os::text_of(folder.filename()) + ".";
    for (const auto& entry : fs::directory_iterator(folder.parent_path(), code)) {
        const std::string found = os::text_of(entry.path().filename());
        if (found.compare(0, prefix.size(), prefix) != 0) continue;
        const int process = std::atoi(found.c_str() + prefix.size());
        if (process > 0 && !os::may_run(process)) fs::remove_all(entry, code);
    }
}

}  // namespace

std::string srn_intrinsics(const scene::Camera& camera) {
    const double first[] = {camera.fx, camera.cx, camera.cy, 0};
    return text_of(first, 4) + "0 0 0\n1\n" + format("%u %u\n", camera.height, camera.width);
}

std::string srn_pose(const scene::Camera& camera) {
    const scene::Mat3 turn = glm::transpose(scene::rotation_of(camera.world_to_camera));
    return text_of(scene::make_pose(turn, scene::camera_center(camera)).data(), 16);
}

Status write_picture(const fs::path& folder, const std::string& kind, const std::string& name,
                     const Image& picture) {
    SPLAT_ASSIGN(const Buffer file, write_png(picture, PngEffort::kFast));
    return write_new_file(os::text_of(folder / kind / (name + ".png")), file);
}

Result<bool> is_made_with(const fs::path& folder, const char* name, const std::string& values) {
    SPLAT_ASSIGN(const bool is_there, has_file(os::text_of(folder / name)));
    if (!is_there) return false;
    SPLAT_ASSIGN(const Buffer found, read_file(os::text_of(folder / name), kMostValues));
    if (as_text(found) == values) return true;
    return invalid(
        "'%s' holds data made with other values: %.*sexpected: %suse another folder, "
        "or the same values to add objects",
        os::text_of(folder).c_str(), static_cast<int>(found.size()), as_text(found).data(),
        values.c_str());
}

Status make_with(const fs::path& folder, const char* name, const std::string& values) {
    SPLAT_ASSIGN(const bool is_there, is_made_with(folder, name, values));
    return is_there ? Status() : write_file(os::text_of(folder / name), as_bytes(values));
}

Status write_once(const fs::path& folder, const std::function<Status(const fs::path&)>& write) {
    std::error_code code;
    if (fs::exists(folder, code)) return {};
    remove_stale(folder);
    const Status status = write_folder(folder, temporary_of(folder), write);
    return fs::exists(folder, code) ? Status() : status;  // another writer may be faster
}

}  // namespace splat::io
