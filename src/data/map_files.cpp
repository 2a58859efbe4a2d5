#include "data/map_files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "data/folder.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/npy.h"
#include "io/photo/image_file.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

bool is_npy_name(const fs::path& path) {
    return path.extension() == ".npy" || path.extension() == ".NPY";
}

/// "depth" and "depths".
std::vector<std::string> folder_names(MapKind kind) {
    return {map_name(kind), std::string(map_name(kind)) + "s"};
}

/// The stem of the view that a map belongs to.
std::string stem_of(const std::string& file, const std::set<std::string>& views) {
    const fs::path stem = fs::path(file).stem();
    const std::string inner = stem.stem().string();
    return !views.contains(stem.string()) && views.contains(inner) ? inner : stem.string();
}

/// Stems of the maps of a kind, sorted. Other files are noted.
Result<std::vector<std::string>> stems_of_maps(const fs::path& folder, MapKind kind,
                                               const std::vector<std::string>& views,
                                               DatasetIndex& index) {
    const std::set<std::string> known(views.begin(), views.end());
    std::vector<std::string> found;
    for (const std::string& name : folder_names(kind)) {
        const auto entries = io::entries_in((folder / name).string());
        if (entries.status().code() == Code::kNotFound) {
            SPLAT_ASSIGN(const io::PathKind there, io::kind_of((folder / name).string()));
            SPLAT_TRY(check_link(there, folder / name));
            continue;
        }
        if (!entries.ok()) return entries.status();
        for (const io::FolderEntry& entry : entries.value()) {
            if (io::is_image_name(entry.name) || is_npy_name(entry.name))
                found.push_back(stem_of(entry.name, known));
            else
                index.add_unread((folder / name / entry.name).string());
        }
    }
    std::sort(found.begin(), found.end());
    return found;
}

/// Adds [height,width,channels] of numbers as bytes.
Status add_bytes(std::vector<float>& values, MapKind kind, DepthNumbers numbers, io::Image& image) {
    const auto bad = std::find_if_not(values.begin(), values.end(),
                                      [](float value) { return std::isfinite(value); });
    if (bad != values.end())
        return error(Code::kFormat, "number %zu is %g, expected finite ones",
                     static_cast<std::size_t>(bad - values.begin()), static_cast<double>(*bad));
    double least = 0, most = 1;
    if (kind == MapKind::kNormal) least = -1;
    if (kind == MapKind::kDepth) {
        if (numbers == DepthNumbers::kDistance)
            for (float& value : values) value = value > 0 ? 1 / value : 0;
        least = std::numeric_limits<double>::infinity();
        most = -least;
        for (const float value : values) {
            if (numbers == DepthNumbers::kDistance && value == 0) continue;  // not known
            least = std::min(least, static_cast<double>(value));
            most = std::max(most, static_cast<double>(value));
        }
    }
    const double scale = most > least ? 255 / (most - least) : 0;
    image.bits = 8;
    image.samples.clear();
    for (const float value : values)
        image.samples.push_back(io::to_byte(scale * (static_cast<double>(value) - least)));
    return {};
}

Result<io::Image> load_numbers(const fs::path& path, MapKind kind, const io::ImageOptions& options,
                               DepthNumbers numbers) {
    constexpr std::uint64_t kHeaderBytes = 4096;
    SPLAT_ASSIGN(const auto source, io::open_source(path.string()));
    io::Buffer file(options.header_only ? std::min(kHeaderBytes, source->size()) : source->size());
    SPLAT_TRY(source->read(0, file));
    SPLAT_ASSIGN(const io::NpyHeader header, io::read_npy_header(file));
    const auto& shape = header.shape;
    const std::uint64_t channels = shape.size() == 3 ? shape[2] : 1;
    const bool fits = (shape.size() == 2 || shape.size() == 3) && channels == channels_of(kind) &&
                      shape[0] >= 1 && shape[1] >= 1 && shape[0] <= options.max_side &&
                      shape[1] <= options.max_side;
    if (!fits || (options.square && shape[0] != shape[1]))
        return error(Code::kFormat, "expected an array [height,width%s] of sides of 1 to %u%s",
                     channels_of(kind) == 3 ? ",3" : "", options.max_side,
                     options.square ? ", a square" : "");
    io::Image image{static_cast<std::uint32_t>(shape[1]),
                    static_cast<std::uint32_t>(shape[0]),
                    static_cast<std::uint32_t>(channels),
                    8,
                    {}};
    if (options.header_only) return image;
    SPLAT_ASSIGN(io::FloatArray array, io::read_npy(file));
    SPLAT_TRY(add_bytes(array.values, kind, numbers, image));
    return image;
}

}  // namespace

Status find_map_files(const fs::path& folder, const std::vector<std::string>& stems, bool lenient,
                      DatasetIndex& index, std::uint32_t given) {
    std::vector<std::string> expected = stems;
    std::sort(expected.begin(), expected.end());
    for (const MapKind kind : kMaps) {
        if ((given & flag_of(kind)) != 0) continue;
        SPLAT_ASSIGN(std::vector<std::string> found, stems_of_maps(folder, kind, expected, index));
        const auto twin = std::adjacent_find(found.begin(), found.end());
        if (found.empty()) {
            index.add_lacking(kind, (folder / map_name(kind)).string());
            continue;
        }
        const Status same =
            twin == found.end()
                ? check_same(folder.string(), map_name(kind), expected, found)
                : error(Code::kFormat, "'%s': two files are the %s of view '%s'; remove one",
                        folder.c_str(), map_name(kind), twin->c_str());
        if (!same.ok() && !lenient) return same;
        if (!same.ok()) index.problems.back().push_back(same.message());
    }
    return {};
}

Result<fs::path> map_file(const fs::path& folder, MapKind kind, const std::string& stem) {
    for (const std::string& name : folder_names(kind)) {
        fs::path usual = folder / name / (stem + ".png");
        SPLAT_ASSIGN(const bool is_usual, io::has_file(usual.string()));
        if (is_usual) return usual;
    }
    fs::path by_name;  // "a.jpg.png" of the view "a.jpg"
    for (const std::string& name : folder_names(kind)) {
        const auto entries = io::entries_in((folder / name).string());
        if (entries.status().code() == Code::kNotFound) continue;
        if (!entries.ok()) return entries.status();
        for (const io::FolderEntry& entry : entries.value()) {
            if (!io::is_image_name(entry.name) && !is_npy_name(entry.name)) continue;
            const fs::path own = fs::path(entry.name).stem();
            if (own == stem) return folder / name / entry.name;
            if (own.stem() == stem) by_name = folder / name / entry.name;
        }
    }
    if (!by_name.empty()) return by_name;
    return error(Code::kNotFound, "'%s' has no map '%s'", (folder / map_name(kind)).c_str(),
                 stem.c_str());
}

Result<io::Image> load_map(const fs::path& path, MapKind kind, const io::ImageOptions& options,
                           DepthNumbers numbers) {
    if (is_npy_name(path)) {
        auto map = load_numbers(path, kind, options, numbers);
        if (!map.ok() && map.status().code() == Code::kFormat)
            return in_file(map.status(), path.string());
        return map;
    }
    SPLAT_ASSIGN(io::Image image, io::load_image(path.string(), options));
    const bool scaled = kind == MapKind::kDepth &&
                        (image.bits == 16 || numbers == DepthNumbers::kDistance) &&
                        (image.channels == 1 || image.channels == 3);
    if (!scaled || options.header_only) return reduced_to_bytes(std::move(image));
    std::vector<float> values(image.samples.begin(), image.samples.end());
    SPLAT_TRY(add_bytes(values, kind, numbers, image));
    return image;
}

}  // namespace splat::data
