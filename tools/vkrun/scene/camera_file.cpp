#include "vkrun/scene/camera_file.h"

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <filesystem>
#include <numbers>

#include "core/os/path.h"
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

Json camera_report(const std::string& path, const splat_camera_file_desc& desc) {
    try {
        return Json::parse(library_text(
            [&](char* buffer, std::size_t capacity, std::size_t* needed) {
                return splat_camera_load_report(path.c_str(), &desc, buffer, capacity, needed);
            },
            kBadData));
    } catch (const Failure& failure) {
        throw with_lens_option(failure, "--ignore-distortion");
    }
}

}  // namespace

Failure with_lens_option(const Failure& failure, const std::string& option) {
    return with_advice(failure, ", or ignore it (SPLAT_CAMERA_IGNORE_DISTORTION)",
                       option.empty() ? "" : ", or ignore it by " + option);
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
    const bool given = options.size.width != 0;
    auto desc = sized<splat_camera_file_desc>();
    desc.flags = options.ignore_distortion ? SPLAT_CAMERA_IGNORE_DISTORTION : 0;
    desc.width = given ? options.size.width : kPlaceholderSide;
    desc.height = given ? options.size.height : kPlaceholderSide;
    const Json report = camera_report(path, desc);
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

std::string cameras_in(const std::string& path, bool transforms) {
    const std::filesystem::path folder = splat::os::path_of(path);
    std::error_code none;
    const auto has = [&](const std::filesystem::path& file) {
        return std::filesystem::exists(folder / file, none);
    };
    if (!transforms)
        for (const char* const place : {"", "sparse/0", "sparse"})
            for (const char* const file : {"cameras.bin", "cameras.txt"})
                if (has(splat::os::path_of(place) / file)) return path;
    for (const char* const file : {"transforms.json", "transforms_train.json"})
        if (has(file)) return splat::os::text_of(folder / file);
    return path;
}

std::vector<splat_camera> orbit_cameras(splat_scene scene, const ImageSize& size,
                                        double elevation_degrees, double distance,
                                        std::uint32_t count) {
    auto desc = sized<splat_orbit_desc>();
    desc.width = size.width;
    desc.height = size.height;
    desc.elevation = elevation_degrees * std::numbers::pi / 180;
    desc.distance = distance;
    std::vector<splat_camera> cameras(count);
    const splat_result made = splat_camera_orbit(scene, &desc, count, cameras.data());
    if (made == SPLAT_ERROR_INVALID_ARGUMENT && distance == 0)
        throw Failure(kBadData,
                      "the scene has no visible extent that an orbit could be placed by: give "
                      "--distance");
    check(made, kBadData);
    return cameras;
}

void print_warnings(const CameraFile& file) {
    for (const std::string& warning : file.warnings)
        std::fprintf(stderr, "vkrun: warning: %s\n", warning.c_str());
}

void check_distance(const std::string& name, const splat_camera& camera,
                    const splat_scene_info& scene, bool lenient) {
    constexpr double kMostRadii = 1e6;
    double squares = 0;
    for (int row = 0; row < 3; ++row) {
        const double* r = camera.world_to_camera + std::ptrdiff_t{4} * row;
        const double at =
            r[0] * scene.center[0] + r[1] * scene.center[1] + r[2] * scene.center[2] + r[3];
        squares += at * at;
    }
    const double radii = std::sqrt(squares) / scene.radius;
    if (!(scene.radius > 0) || radii <= kMostRadii) return;
    const std::string found =
        format("camera '%s' is %g radii of the scene away from its centre", name.c_str(), radii);
    if (!lenient)
        throw Failure(kBadData,
                      found + format(", expected at most %g; --lenient renders it", kMostRadii));
    std::fprintf(stderr, "vkrun: warning: %s\n", found.c_str());
}

}  // namespace vkrun
