#include "vkrun/scene_input.h"

#include <filesystem>

#include "vkrun/command.h"

namespace vkrun {

SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc) {
    SceneFile file;
    check(splat_scene_load(path.c_str(), desc, file.scene.out()));
    file.info = sized<splat_scene_info>();
    check(splat_scene_get_info(file.scene.get(), &file.info));
    file.report = Json::parse(whole_text([&](char* buffer, std::size_t capacity, std::size_t* n) {
        return splat_scene_load_report(file.scene.get(), buffer, capacity, n);
    }));
    return file;
}

CameraFile load_cameras(const std::string& path, std::uint32_t width, std::uint32_t height) {
    auto desc = sized<splat_camera_file_desc>();
    desc.width = width;
    desc.height = height;
    CameraFile file;
    std::uint32_t count = 0;
    check(splat_camera_load(path.c_str(), &desc, nullptr, 0, &count));
    file.cameras.resize(count);
    check(splat_camera_load(path.c_str(), &desc, file.cameras.data(), count, nullptr));
    const Json report =
        Json::parse(whole_text([&](char* buffer, std::size_t capacity, std::size_t* n) {
            return splat_camera_load_report(path.c_str(), &desc, buffer, capacity, n);
        }));
    file.names = report.at("names").get<std::vector<std::string>>();
    file.warnings = report.at("warnings").get<std::vector<std::string>>();
    return file;
}

splat_frame frame_of(const std::string& name) {
    const char* names[] = {"auto", "RDF", "RUB", "LUF", "RUF", "LDB", "RDB", "LUB", "LDF"};
    for (splat_frame frame = 0; frame <= SPLAT_FRAME_LDF; ++frame)
        if (name == names[frame]) return frame;
    throw Failure(kUsageError,
                  "no frame '" + name + "'; there are: RDF, RUB, LUF, RUF, LDB, RDB, LUB, LDF");
}

void check_target(const std::string& path, bool overwrite) {
    if (!overwrite && std::filesystem::exists(path))
        throw Failure(kUsageError, "'" + path + "' is there already; --overwrite replaces it");
}

}  // namespace vkrun
