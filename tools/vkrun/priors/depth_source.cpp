#include "vkrun/priors/depth_source.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>

#include "core/os/path.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/priors/preset_list.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// The file of a map, such as "depth".
fs::path path_of_map(const MapJob& job, const std::string& map) {
    const fs::path beside =
        job.picture.parent_path().parent_path() / os::path_of(map) / os::path_of(job.stem);
    std::error_code none;
    for (const fs::path& path : {job.map_path(map, ".npy"), job.map_path(map, ".png"),
                                 os::path_of(os::text_of(beside) + ".png")})
        if (fs::exists(path, none)) return path;
    throw Failure(kBadData, "no " + map + " map '" + os::text_of(job.map_path(map, ".png")) +
                                "' or '" + os::text_of(beside) + ".png'");
}

/// Pixels, of SRN's intrinsics.txt: a focal length first, height and width last.
double focal_of(const MapJob& job, const DepthOptions& options, double width) {
    if (options.fov_degrees)
        return width / 2 / std::tan(*options.fov_degrees * std::numbers::pi / 360);
    const fs::path path = job.picture.parent_path().parent_path() / "intrinsics.txt";
    std::ifstream file = open_to_read(path);
    std::vector<double> numbers;
    for (double number = 0; file >> number;) numbers.push_back(number);
    if (numbers.size() < 6 || !(numbers.front() > 0) || !(numbers.back() >= 1))
        throw Failure(kBadData, "no focal length in '" + os::text_of(path) + "': give --fov");
    return numbers.front() / numbers.back() * width;
}

LoadedDepth load_file(const fs::path& path, std::uint32_t channels = 1) {
    LoadedDepth loaded;
    loaded.image.type = SPLAT_PIXEL_F32;
    check(splat_image_load(os::text_of(path).c_str(), &loaded.image, nullptr), kBadData);
    if (loaded.image.channels != channels)
        throw Failure(kBadData, "'" + os::text_of(path) + "' has " +
                                    std::to_string(loaded.image.channels) + " channels, expected " +
                                    std::to_string(channels));
    loaded.values.resize(std::size_t{loaded.image.width} * loaded.image.height * channels);
    loaded.image.pixels = loaded.values.data();
    check(splat_image_load(os::text_of(path).c_str(), &loaded.image, nullptr), kBadData);
    return loaded;
}

}  // namespace

std::string inverse_preset_of(const std::string& folder) {
    const fs::path path = os::path_of(folder) / "priors-depth.json";
    std::error_code none;
    if (!fs::exists(path, none)) return "";
    const Json record = Json::parse(read_text(os::text_of(path)), nullptr, false);
    if (!record.is_object() || record.value("format", Json()) != "npy") return "";
    for (const std::string& name : preset_names()) {
        if (record.value("preset", Json()) != name) continue;
        const Json preset = preset_json(name).at("preset");
        for (const Json& output : preset.at("outputs"))
            if (output.at("map") == "depth" && output.value("depth", "inverse") == "inverse")
                return name;
    }
    return "";
}

LoadedDepth load_depth_plane(const MapJob& job) {
    const fs::path path = path_of_map(job, "depth");
    LoadedDepth loaded = load_file(path);
    if (path.extension() != ".npy") return loaded;
    const auto [least, most] = std::minmax_element(loaded.values.begin(), loaded.values.end());
    const float low = *least;
    const float range = *most - low;
    for (float& value : loaded.values) value = range > 0 ? (value - low) / range : 0;
    return loaded;
}

LoadedDepth load_depth(const MapJob& job, const DepthOptions& options) {
    const fs::path path = path_of_map(job, "depth");
    const bool numbers = path.extension() == ".npy";
    if (numbers && !options.inverse_preset.empty())
        throw Failure(kUsageError, "'" + os::text_of(path) + "' has the inverse depth of preset '" +
                                       options.inverse_preset +
                                       "', expected distances: make the depth maps again with "
                                       "--format png16, and give --distances NEAREST FARTHEST");
    const bool distances = numbers && options.distances.empty();
    if (!distances && options.distances.empty())
        throw Failure(kUsageError, "'" + os::text_of(path) +
                                       "' is relative depth: give --distances NEAREST FARTHEST");
    LoadedDepth loaded = load_file(path);
    loaded.desc = sized<splat_normals_desc>();
    loaded.desc.focal_x = loaded.desc.focal_y = focal_of(job, options, loaded.image.width);
    if (!distances) {
        loaded.desc.nearest = options.distances[0];
        loaded.desc.farthest = options.distances[1];
    }
    return loaded;
}

LoadedDepth load_normals(const MapJob& job, bool vectors) {
    const fs::path path = path_of_map(job, "normal");
    LoadedDepth loaded = load_file(path, 3);
    const bool numbers = path.extension() == ".npy";
    for (float& n : loaded.values)
        if (numbers != vectors) n = vectors ? 2 * n - 1 : (n + 1) / 2;
    return loaded;
}

}  // namespace vkrun
