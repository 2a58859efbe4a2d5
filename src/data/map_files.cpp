#include "data/map_files.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "core/os/path.h"
#include "data/folder.h"
#include "data/planes/plane_channels.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/maps/number_image.h"
#include "io/photo/image_file.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

bool is_map_name(const std::string& name) {
    return io::is_image_name(name) || io::is_number_name(name);
}

/// "depth" and "depths".
std::vector<std::string> folder_names(MapKind kind) {
    return {map_name(kind), std::string(map_name(kind)) + "s"};
}

/// The stem of the view that a map belongs to.
std::string stem_of(const std::string& file, const std::set<std::string>& views) {
    const fs::path stem = os::path_of(file).stem();
    const std::string inner = os::text_of(stem.stem());
    return !views.contains(os::text_of(stem)) && views.contains(inner) ? inner : os::text_of(stem);
}

/// Stems of the maps of a kind, sorted. Other files are noted.
Result<std::vector<std::string>> stems_of_maps(const fs::path& folder, MapKind kind,
                                               const std::vector<std::string>& views,
                                               DatasetIndex& index) {
    const std::set<std::string> known(views.begin(), views.end());
    std::vector<std::string> found;
    for (const std::string& name : folder_names(kind)) {
        const auto entries = io::entries_in(os::text_of(folder / name));
        if (entries.status().code() == Code::kNotFound) {
            SPLAT_ASSIGN(const io::PathKind there, io::kind_of(os::text_of(folder / name)));
            SPLAT_TRY(check_link(there, folder / name));
            continue;
        }
        if (!entries.ok()) return entries.status();
        for (const io::FolderEntry& entry : entries.value()) {
            if (is_map_name(entry.name))
                found.push_back(stem_of(entry.name, known));
            else
                index.add_unread(os::text_of(folder / name / entry.name));
        }
    }
    std::ranges::sort(found);
    return found;
}

Status check_finite(const std::vector<float>& values) {
    const auto bad =
        std::ranges::find_if_not(values, [](float value) { return std::isfinite(value); });
    if (bad == values.end()) return {};
    return damaged("number %zu is %g, expected finite ones: write 0 where there is none",
                   static_cast<std::size_t>(bad - values.begin()), static_cast<double>(*bad));
}

/// Adds [height,width,4] of planes' normals and distances as bytes; all are 0 where the distance is not above 0.
void add_planes(const std::vector<float>& values, io::Image& image) {
    double farthest = 0;
    for (std::size_t i = 3; i < values.size(); i += 4)
        farthest = std::max(farthest, static_cast<double>(values[i]));
    for (std::size_t i = 0; i < values.size(); ++i) {
        const auto distance = static_cast<double>(values[i | 3U]);
        double byte = 0;
        if (distance > 0)
            byte = i % 4 == 3 ? std::max(255 * distance / farthest, 1.0)
                              : 127.5 * (static_cast<double>(values[i]) + 1);
        image.samples.push_back(io::to_byte(byte));
    }
}

/// Adds [height,width,channels] of numbers as bytes.
Status add_bytes(std::vector<float>& values, MapKind kind, DepthNumbers numbers, io::Image& image) {
    SPLAT_TRY(check_finite(values));
    image.bits = 8;
    image.samples.clear();
    if (kind == MapKind::kPlane) {
        add_planes(values, image);
        return check_planes(image.samples, image.width);
    }
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
    for (const float value : values)
        image.samples.push_back(io::to_byte(scale * (static_cast<double>(value) - least)));
    return {};
}

/// Whole numbers are samples of 8 or 16 bits; those of masks of 8 where none is greater. Errors: kFormat for others.
Status add_samples(const std::vector<float>& values, MapKind kind, io::Image& image) {
    const auto [least, most] = std::ranges::minmax_element(values);
    if (*least < 0 || *most > 65535)
        return damaged("whole numbers from %g to %g, expected 0 to 65535",
                       static_cast<double>(*least), static_cast<double>(*most));
    if (kind == MapKind::kMask && *most <= 255) image.bits = 8;
    image.samples.assign(values.begin(), values.end());
    return {};
}

/// The samples as bytes; depth of 16 bits, and distances, scaled. Distances of planes stay above 0. Errors: as
/// add_bytes() and check_planes().
Result<io::Image> in_bytes(io::Image image, MapKind kind, DepthNumbers numbers) {
    const bool scaled = kind == MapKind::kDepth && !image.samples.empty() &&
                        (image.bits == 16 || numbers == DepthNumbers::kDistance) &&
                        (image.channels == 1 || image.channels == 3);
    if (kind == MapKind::kPlane) {
        constexpr std::uint16_t kByte = 257;  // 16 bits become the byte 1
        for (std::size_t i = 3; image.bits == 16 && i < image.samples.size(); i += 4)
            if (image.samples[i] != 0) image.samples[i] = std::max(image.samples[i], kByte);
        image = reduced_to_bytes(std::move(image));
        SPLAT_TRY(check_planes(image.samples, image.width));
        return image;
    }
    if (!scaled) return reduced_to_bytes(std::move(image));
    std::vector<float> values(image.samples.begin(), image.samples.end());
    SPLAT_TRY(add_bytes(values, kind, numbers, image));
    return image;
}

Result<io::Image> load_numbers(const fs::path& path, MapKind kind, const io::ImageOptions& options,
                               DepthNumbers numbers) {
    constexpr std::uint64_t kHeaderBytes = 4096;
    SPLAT_ASSIGN(const auto source, io::open_source(os::text_of(path)));
    io::Buffer file(options.header_only ? std::min(kHeaderBytes, source->size()) : source->size());
    SPLAT_TRY(source->read(0, file));
    SPLAT_ASSIGN(io::NumberImage found,
                 io::read_number_image(file, options.header_only ? io::NumberPart::kHeader
                                                                 : io::NumberPart::kValues));
    if (found.channels != channels_of(kind) || (options.square && found.width != found.height))
        return damaged("%u x %u numbers of %u channels, expected %u channels%s", found.width,
                       found.height, found.channels, channels_of(kind),
                       options.square ? " and a square" : "");
    io::Image image{
        found.width, found.height, found.channels, found.bits == 0 ? 8 : found.bits, {}};
    if (options.header_only) return image;
    if (found.bits == 0) {
        SPLAT_TRY(add_bytes(found.values, kind, numbers, image));
        return image;
    }
    SPLAT_TRY(add_samples(found.values, kind, image));
    return in_bytes(std::move(image), kind, numbers);
}

/// The numbers of a photograph's map as they are stored.
Result<io::NumberImage> load_values(const std::string& path, std::uint32_t width,
                                    std::uint32_t height, std::uint32_t channels) {
    io::NumberImage map;
    if (io::is_number_name(path)) {
        SPLAT_ASSIGN(const io::Buffer file, io::read_file(path));
        SPLAT_ASSIGN(map, in_file(io::read_number_image(file), path));
    } else {
        SPLAT_ASSIGN(const io::Image image, io::load_image(path));
        map = {image.width, image.height, image.channels, image.bits, {}};
        map.values.assign(image.samples.begin(), image.samples.end());
    }
    if (map.channels != channels)
        return damaged("'%s': %u channels, expected %u", path.c_str(), map.channels, channels);
    if (map.width != width || map.height != height)
        return damaged("'%s': %u x %u pixels, its photograph has %u x %u", path.c_str(), map.width,
                       map.height, width, height);
    SPLAT_TRY(in_file(check_finite(map.values), path));
    const auto [least, most] = std::ranges::minmax_element(map.values);
    if (*least == *most)
        return damaged("'%s': every number is %g, expected a map that shows something",
                       path.c_str(), static_cast<double>(*least));
    return map;
}

/// Empty if there is none.
Result<std::string> map_of(const fs::path& folder, const std::string& name) {
    for (const fs::path& base : {folder / name, (folder / name).replace_extension()})
        for (const char* const ending : {".npy", ".pfm", ".png"}) {
            std::string path = os::text_of(base) + ending;
            SPLAT_ASSIGN(const bool is_there, io::has_file(path));
            if (is_there) return path;
        }
    return std::string();
}

Result<std::vector<float>> load_nearness(const std::string& path, std::uint32_t width,
                                         std::uint32_t height, DepthNumbers numbers) {
    SPLAT_ASSIGN(io::NumberImage map, load_values(path, width, height, 1));
    constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    float least = std::numeric_limits<float>::infinity(), most = -least;
    for (float& value : map.values) {
        if (numbers == DepthNumbers::kDistance) value = value > 0 ? 1 / value : kUnknown;
        if (std::isnan(value)) continue;
        least = std::min(least, value);
        most = std::max(most, value);
    }
    if (!(least < most))
        return damaged("'%s': no two distances above 0 differ, expected a map that shows something",
                       path.c_str());
    for (float& value : map.values) value = (value - least) / (most - least);
    return std::move(map.values);
}

Result<std::vector<std::uint32_t>> load_normals(const std::string& path, std::uint32_t width,
                                                std::uint32_t height) {
    SPLAT_ASSIGN(const io::NumberImage map, load_values(path, width, height, 3));
    const float scale = map.bits == 0 ? 1 : 2 / static_cast<float>((1U << map.bits) - 1);
    const float shift = map.bits == 0 ? 0 : -1;
    std::vector<std::uint32_t> made(std::size_t{width} * height);
    for (std::size_t i = 0; i < made.size(); ++i) {
        float squared = 0;
        std::uint32_t word = 255U << 24;
        for (std::size_t k = 0; k < 3; ++k) {
            const float n = map.values[3 * i + k] * scale + shift;
            squared += n * n;
            word |= static_cast<std::uint32_t>(io::to_byte(127.5 * (static_cast<double>(n) + 1)))
                    << (8 * k);
        }
        made[i] = squared < 0.25F ? 0 : word;
    }
    return made;
}

}  // namespace

Result<io::Image> nearness_of_distances(std::vector<float> distances, std::uint32_t width,
                                        std::uint32_t height) {
    io::Image image{width, height, 1, 8, {}};
    SPLAT_TRY(add_bytes(distances, MapKind::kDepth, DepthNumbers::kDistance, image));
    return image;
}

Status find_photo_maps(const PosedPhotosOptions& options, const std::vector<std::string>& names) {
    for (const auto& [what, folder] :
         {std::pair("depth", &options.depth), std::pair("normals", &options.normals)}) {
        std::vector<std::string> missing;
        for (const std::string& name : names) {
            if (folder->empty()) break;
            SPLAT_ASSIGN(const std::string path, map_of(os::path_of(*folder), name));
            if (path.empty()) missing.push_back(os::text_of(os::path_of(*folder) / name));
        }
        if (!missing.empty())
            return not_found(
                "%zu of %zu maps of %s are missing, such as '%s', .npy, .pfm or .png; expected one "
                "for each photograph to fit, as 'vkrun priors' makes them",
                missing.size(), names.size(), what, missing[0].c_str());
    }
    return {};
}

Status read_photo_maps(const PosedPhotosOptions& options, const std::string& name,
                       PosedPhoto& photo) {
    if (!options.depth.empty()) {
        SPLAT_ASSIGN(const std::string path, map_of(os::path_of(options.depth), name));
        SPLAT_SET(photo.nearness,
                  load_nearness(path, photo.width, photo.height,
                                options.depth_is_distance ? DepthNumbers::kDistance
                                                          : DepthNumbers::kNearness));
    }
    if (!options.normals.empty()) {
        SPLAT_ASSIGN(const std::string path, map_of(os::path_of(options.normals), name));
        SPLAT_SET(photo.normals, load_normals(path, photo.width, photo.height));
    }
    return {};
}

Status find_map_files(const fs::path& folder, const std::vector<std::string>& stems, bool lenient,
                      DatasetIndex& index, std::uint32_t given) {
    std::vector<std::string> expected = stems;
    std::ranges::sort(expected);
    for (const MapKind kind : kMaps) {
        if ((given & flag_of(kind)) != 0) continue;
        SPLAT_ASSIGN(std::vector<std::string> found, stems_of_maps(folder, kind, expected, index));
        const auto twin = std::ranges::adjacent_find(found);
        if (found.empty()) {
            index.add_lacking(kind, os::text_of(folder / map_name(kind)));
            continue;
        }
        const Status same =
            twin == found.end()
                ? check_same(os::text_of(folder), map_name(kind), expected, found)
                : damaged("'%s': two files are the %s of view '%s'; remove one",
                          os::text_of(folder).c_str(), map_name(kind), twin->c_str());
        if (!same.ok() && !lenient) return same;
        if (!same.ok()) index.problems.back().push_back(same.message());
    }
    return {};
}

Result<fs::path> map_file(const fs::path& folder, MapKind kind, const std::string& stem) {
    for (const std::string& name : folder_names(kind)) {
        fs::path usual = folder / name / (stem + ".png");
        SPLAT_ASSIGN(const bool is_usual, io::has_file(os::text_of(usual)));
        if (is_usual) return usual;
    }
    fs::path by_name;  // "a.jpg.png" of the view "a.jpg"
    for (const std::string& name : folder_names(kind)) {
        const auto entries = io::entries_in(os::text_of(folder / name));
        if (entries.status().code() == Code::kNotFound) continue;
        if (!entries.ok()) return entries.status();
        for (const io::FolderEntry& entry : entries.value()) {
            if (!is_map_name(entry.name)) continue;
            const fs::path own = os::path_of(entry.name).stem();
            if (os::text_of(own) == stem) return folder / name / entry.name;
            if (os::text_of(own.stem()) == stem) by_name = folder / name / entry.name;
        }
    }
    if (!by_name.empty()) return by_name;
    return not_found("'%s' has no map '%s'", os::text_of(folder / map_name(kind)).c_str(),
                     stem.c_str());
}

Result<io::Image> load_map(const fs::path& path, MapKind kind, const io::ImageOptions& options,
                           DepthNumbers numbers) {
    if (io::is_number_name(os::text_of(path))) {
        auto map = load_numbers(path, kind, options, numbers);
        const Code code = map.status().code();
        if (code == Code::kFormat || code == Code::kUnsupported)
            return in_file(map.status(), os::text_of(path));
        return map;
    }
    SPLAT_ASSIGN(io::Image image, io::load_image(os::text_of(path), options));
    if (kind == MapKind::kPlane && image.channels != channels_of(kind))
        return damaged("'%s': %u channels, expected %u of a map of planes: normal and distance",
                       os::text_of(path).c_str(), image.channels, channels_of(kind));
    return in_file(in_bytes(std::move(image), kind, numbers), os::text_of(path));
}

Result<bool> FilesReader::add(const fs::path& folder, const std::string& name,
                              const ViewNames& names, const std::string& before,
                              const std::string& after) {
    SPLAT_ASSIGN(const std::vector<std::string> views,
                 index_.add(name, os::text_of(folder), names, desc_.lenient));
    FilesObject& object = objects_.emplace_back(FilesObject{folder, {}, {}});
    for (const std::string& view : views) {
        object.images.push_back(before + view + after);
        object.stems.push_back(os::text_of(os::path_of(object.images.back()).stem()));
    }
    SPLAT_TRY(find_map_files(folder, object.stems, desc_.lenient, index_));
    return true;
}

Result<io::Image> FilesReader::image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                     bool header_only) const {
    const FilesObject& found = objects_[object];
    if (kind == MapKind::kRgb) return load_square(found.folder / found.images[view], header_only);
    SPLAT_ASSIGN(const fs::path path, map_file(found.folder, kind, found.stems[view]));
    return load_map(path, kind, {.square = true, .header_only = header_only});
}

}  // namespace splat::data
