#include "vkrun/fit/geometry_maps.h"

#include <cstdio>
#include <filesystem>
#include <vector>

#include "core/os/path.h"
#include "vkrun/cli/failure.h"
#include "vkrun/cli/files.h"
#include "vkrun/cli/handles.h"
#include "vkrun/cli/picture.h"
#include "vkrun/priors/map_maker.h"

namespace vkrun {
namespace {

namespace fs = std::filesystem;
namespace os = splat::os;

/// A map of one channel as numbers.
struct NumberMap {
    std::vector<float> values;
    splat_image image{};
};

NumberMap load_numbers(const std::string& path) {
    NumberMap map;
    check(splat_image_load(path.c_str(), &map.image, nullptr), kBadData);
    map.values.resize(std::size_t{map.image.width} * map.image.height);
    map.image = interleaved_image(map.values.data(), map.image.width, map.image.height, 1);
    check(splat_image_load(path.c_str(), &map.image, nullptr), kBadData);
    return map;
}

/// Sets depth to 0 where the mask has none, which 'vkrun priors' writes as farthest.
void drop_unknown(const std::string& depth_path, const std::string& mask_path) {
    NumberMap depth = load_numbers(depth_path);
    const NumberMap mask = load_numbers(mask_path);
    for (std::size_t i = 0; i < depth.values.size() && i < mask.values.size(); ++i)
        if (!(mask.values[i] > 0.5F)) depth.values[i] = 0;
    check(splat_image_save(depth_path.c_str(), &depth.image), kFailed);
}

/// OUT-geometry: a folder with other files than a run's cannot become that of a run.
fs::path folder_beside(const std::string& out) {
    fs::path run = os::path_of(out).lexically_normal();
    if (!run.has_filename()) run = run.parent_path();
    return os::path_of(os::text_of(run) + "-geometry");
}

/// Says of which photographs all maps of a folder are.
struct Note {
    fs::path path;
    std::string photos;

    /// True if maps are there that may be of others. There is no note then until keep(), so that a run after an
    /// interruption replaces all of them, too.
    [[nodiscard]] bool of_others() const {
        std::error_code none;
        if (!fs::exists(path.parent_path(), none)) keep();
        if (fs::exists(path, none) && read_text(os::text_of(path)) == photos) return false;
        fs::remove(path, none);
        return true;
    }
    void keep() const {
        make_folder(path.parent_path());
        replace_file(path, photos);
    }
};

}  // namespace

GeometryMaps make_geometry_maps(const std::string& network, const std::string& photos,
                                const std::string& out, const std::string& device, bool overwrite) {
    const fs::path folder = folder_beside(out);
    MapOptions options;
    options.map = "depth";
    options.all = true;
    options.format = "npy";
    options.in = photos;
    options.out = os::text_of(folder);
    options.device = device;
    const Note note{folder / "photographs.txt",
                    os::text_of(fs::weakly_canonical(os::path_of(photos))) + "\n"};
    options.overwrite = note.of_others() || overwrite;
    std::error_code none;
    if (fs::is_regular_file(os::path_of(network), none))
        options.model = network;
    else
        options.preset = network;
    std::fprintf(stderr, "--geometry: maps of the photographs, in '%s'\n", options.out.c_str());
    const MapReport report = make_maps(options);
    if (report.failed > 0)
        throw Failure(kBadData, std::to_string(report.failed) +
                                    " photographs have no maps: repair or remove them");
    if (report.maps.size() != 3)
        throw Failure(kUsageError, "--geometry: preset '" + report.preset +
                                       "' does not make depth, normals and masks in one pass");
    note.keep();
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder / "depth"))
        if (extension_of(entry.path()) == ".npy")
            drop_unknown(
                os::text_of(entry.path()),
                os::text_of(folder / "mask" / entry.path().lexically_relative(folder / "depth")));
    return {os::text_of(folder / "depth"), os::text_of(folder / "normal")};
}

}  // namespace vkrun
