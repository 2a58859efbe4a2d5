#include "vkrun/scene_input.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "vkrun/command.h"
#include "vkrun/table.h"

namespace vkrun {
namespace {

constexpr std::uint32_t kMaxSide = 16384;  ///< of an image in the library
constexpr std::uint32_t kStandInSide = 1024;

std::vector<splat_camera> cameras_of(const std::string& path, const splat_camera_file_desc& desc,
                                     std::size_t count) {
    std::vector<splat_camera> cameras(count);
    check(splat_camera_load(path.c_str(), &desc, cameras.data(), static_cast<std::uint32_t>(count),
                            nullptr),
          kBadData);
    return cameras;
}

}  // namespace

const Json& scene_formats() {
    static const Json formats = Json::parse(whole_text(splat_scene_formats));
    return formats;
}

std::string scene_extensions(bool written) {
    std::vector<std::string> extensions;
    for (const Json& format : scene_formats()) {
        if (written && !format.at("written").get<bool>()) continue;
        const auto extension = format.at("extension").get<std::string>();
        if (std::find(extensions.begin(), extensions.end(), extension) == extensions.end())
            extensions.push_back(extension);
    }
    std::string list = extensions.front();
    for (std::size_t i = 1; i < extensions.size(); ++i)
        list += (i + 1 == extensions.size() ? " or " : ", ") + extensions[i];
    return list;
}

std::string scene_formats_text() {
    Table table({"format", "extension", "frame", "holds"});
    for (const Json& format : scene_formats())
        table.add({format.at("name"), format.at("extension"), format.at("frame"),
                   format.at("holds").get<std::string>() +
                       (format.at("written").get<bool>() ? "" : "; read only")});
    return table.text();
}

SceneFile load_scene(const std::string& path, const splat_scene_file_desc* desc) {
    SceneFile file;
    check(splat_scene_load(path.c_str(), desc, file.scene.out()), kBadData);
    file.info = sized<splat_scene_info>();
    check(splat_scene_get_info(file.scene.get(), &file.info));
    file.report = Json::parse(whole_text([&](char* buffer, std::size_t capacity, std::size_t* n) {
        return splat_scene_load_report(file.scene.get(), buffer, capacity, n);
    }));
    return file;
}

ImageSize image_size(const std::string& text) {
    if (text.empty()) return {};
    ImageSize size;
    char rest = 0;
    if (std::sscanf(text.c_str(), "%5ux%5u%c", &size.width, &size.height, &rest) != 2 ||
        size.width < 1 || size.height < 1 || size.width > kMaxSide || size.height > kMaxSide)
        throw Failure(kUsageError, format("--size is '%s', expected WIDTHxHEIGHT, each 1 to %u",
                                          text.c_str(), kMaxSide));
    return size;
}

CameraFile load_cameras(const std::string& path, const CameraFileOptions& options) {
    const bool said = options.size.width != 0;
    auto desc = sized<splat_camera_file_desc>();
    desc.flags = options.ignore_distortion ? SPLAT_CAMERA_IGNORE_DISTORTION : 0;
    desc.width = said ? options.size.width : kStandInSide;
    desc.height = said ? options.size.height : kStandInSide;
    const Json report =
        Json::parse(whole_text([&](char* buffer, std::size_t capacity, std::size_t* n) {
            const splat_result result =
                splat_camera_load_report(path.c_str(), &desc, buffer, capacity, n);
            check(result, kBadData);
            return result;
        }));
    CameraFile file;
    file.names = report.at("names").get<std::vector<std::string>>();
    file.warnings = report.at("warnings").get<std::vector<std::string>>();
    file.cameras = cameras_of(path, desc, file.names.size());
    auto other = desc;
    other.width += other.width < kMaxSide ? 1 : -1;
    other.height += other.height < kMaxSide ? 1 : -1;
    file.resized = cameras_of(path, other, file.names.size());
    std::size_t sizes = 0;
    for (std::size_t i = 0; i < file.cameras.size(); ++i) sizes += file.says_size(i) ? 1 : 0;
    if (said && sizes > 0 && sizes == file.cameras.size())
        throw Failure(kUsageError, "--size is for cameras whose file says no size, but '" + path +
                                       "' says those of all its images");
    if (!said && !options.without_size && sizes < file.cameras.size())
        throw Failure(kUsageError, "'" + path + "' says no size of its images ('w' and 'h'): " +
                                       "give it with --size WIDTHxHEIGHT");
    return file;
}

void check_number(const char* option, double value, double least, double most) {
    if (value >= least && value <= most) return;  // false for NaN
    throw Failure(kUsageError, format("%s is %g, expected %g to %g", option, value, least, most));
}

void check_background(const std::vector<float>& rgb) {
    for (const float value : rgb) check_number("--background", static_cast<double>(value), 0, 1);
}

splat_frame frame_of(const std::string& name) {
    const char* names[] = {"auto", "RDF", "RUB", "LUF", "RUF", "LDB", "RDB", "LUB", "LDF"};
    for (splat_frame frame = 0; frame <= SPLAT_FRAME_LDF; ++frame)
        if (name == names[frame]) return frame;
    throw Failure(kUsageError,
                  "no frame '" + name + "'; there are: RDF, RUB, LUF, RUF, LDB, RDB, LUB, LDF");
}

void check_target(const std::string& path, bool overwrite) {
    std::error_code none;
    if (!overwrite && std::filesystem::exists(path, none))
        throw Failure(kUsageError, "'" + path + "' is there already; --overwrite replaces it");
}

}  // namespace vkrun
