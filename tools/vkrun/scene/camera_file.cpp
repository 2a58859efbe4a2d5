#include "vkrun/scene/camera_file.h"

#include <cstdio>

#include "vkrun/cli/handles.h"
#include "vkrun/cli/json.h"
#include "vkrun/cli/text.h"

namespace vkrun {
namespace {

constexpr std::uint32_t kMaxSide = 16384;  ///< limit of the library
constexpr std::uint32_t kPlaceholderSide = 1024;

std::vector<splat_camera> cameras_of(const std::string& path, const splat_camera_file_desc& desc,
                                     std::size_t count) {
    std::vector<splat_camera> cameras(count);
    check(splat_camera_load(path.c_str(), &desc, cameras.data(), static_cast<std::uint32_t>(count),
                            nullptr),
          kBadData);
    return cameras;
}

}  // namespace

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
    const bool given = options.size.width != 0;
    auto desc = sized<splat_camera_file_desc>();
    desc.flags = options.ignore_distortion ? SPLAT_CAMERA_IGNORE_DISTORTION : 0;
    desc.width = given ? options.size.width : kPlaceholderSide;
    desc.height = given ? options.size.height : kPlaceholderSide;
    const Json report = Json::parse(library_text(
        [&](char* buffer, std::size_t capacity, std::size_t* needed) {
            return splat_camera_load_report(path.c_str(), &desc, buffer, capacity, needed);
        },
        kBadData));
    CameraFile file;
    file.names = report.at("names").get<std::vector<std::string>>();
    file.warnings = report.at("warnings").get<std::vector<std::string>>();
    file.cameras = cameras_of(path, desc, file.names.size());
    auto other = desc;
    other.width += other.width < kMaxSide ? 1 : -1;
    other.height += other.height < kMaxSide ? 1 : -1;
    file.resized = cameras_of(path, other, file.names.size());
    std::size_t sizes = 0;
    for (std::size_t i = 0; i < file.cameras.size(); ++i) sizes += file.has_size(i) ? 1 : 0;
    if (given && sizes > 0 && sizes == file.cameras.size())
        throw Failure(kUsageError, "--size is for camera files without sizes, but '" + path +
                                       "' gives those of all its images");
    if (!given && !options.without_size && sizes < file.cameras.size())
        throw Failure(kUsageError, "'" + path +
                                       "' does not give the size of its images ('w' and 'h'): " +
                                       "pass --size WIDTHxHEIGHT");
    return file;
}

}  // namespace vkrun
