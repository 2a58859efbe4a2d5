#include "data/folder.h"

#include <algorithm>

#include "io/file.h"
#include "scene/camera_pose.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxImageBytes = std::uint64_t{1} << 30;

}  // namespace

std::vector<std::string> folders_in(const fs::path& folder) {
    std::vector<std::string> names;
    std::error_code code;
    for (const auto& entry : fs::directory_iterator(folder, code)) {
        const std::string name = entry.path().filename().string();
        if (name.rfind('.', 0) != 0 && entry.is_directory(code)) names.push_back(name);
    }
    std::sort(names.begin(), names.end());
    return names;
}

std::vector<std::string> stems_in(const fs::path& folder, const std::string& extension) {
    std::vector<std::string> names;
    std::error_code code;
    for (const auto& entry : fs::directory_iterator(folder, code)) {
        const fs::path& path = entry.path();
        if (path.extension() == extension && path.filename().string().rfind('.', 0) != 0)
            names.push_back(path.stem().string());
    }
    std::sort(names.begin(), names.end());
    return names;
}

bool is_file(const fs::path& path) {
    std::error_code code;
    return fs::is_regular_file(path, code);
}

Result<io::Image> load_square(const fs::path& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path.string(), kMaxImageBytes));
    auto image = io::read_png(file);
    if (!image.ok())
        return Status(image.status().code(),
                      format("'%s': ", path.c_str()) + image.status().message());
    io::Image& found = image.value();
    if (found.width != found.height)
        return error(Code::kInvalidArgument, "'%s': %u x %u pixels, expected a square",
                     path.c_str(), found.width, found.height);
    if (found.bits == 16) {
        for (std::uint16_t& sample : found.samples)
            sample = static_cast<std::uint16_t>((sample * 255U + 32767U) / 65535U);
        found.bits = 8;
    }
    return std::move(found);
}

Status check_pose(const scene::Mat4& camera_to_world, const std::string& place) {
    scene::Camera camera{place, 1, 1, 1, 1, 0.5, 0.5, camera_to_world};
    return scene::check_camera(camera);
}

}  // namespace splat::data
