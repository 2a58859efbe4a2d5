#include "data/dataset.h"

#include <algorithm>
#include <array>
#include <filesystem>

#include "core/log.h"
#include "core/os/path.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/formats.h"
#include "data/planes/plane_channels.h"
#include "data/relative_pose.h"
#include "io/folder.h"
#include "tables/store.h"
#include "tables/table_files.h"

namespace splat::data {
namespace {

constexpr std::uint64_t kDefaultCache = std::uint64_t{1} << 30;
constexpr std::uint32_t kMaxResolution = 4096;

struct Format {
    const char* name;
    Result<bool> (*holds)(const std::string& path);
    Result<std::unique_ptr<DatasetReader>> (*open)(const ReaderDesc& desc);
};

/// Tried in this order.
constexpr Format kFormats[] = {{"store", tables::is_store, open_store},
                               {"tables", tables::is_tables, open_tables},
                               {"srn", is_srn, open_srn},
                               {"co3d", is_co3d, open_co3d},
                               {"nmr", is_nmr, open_nmr},
                               {"disn", is_disn, open_disn},
                               {"disn_easy", is_part_of_disn, open_disn_easy},
                               {"disn_hard", is_part_of_disn, open_disn_hard},
                               {"disn_albedo", is_disn_albedo, open_disn_albedo},
                               {"gso", is_gso, open_gso},
                               {"objaverse", is_objaverse, open_objaverse},
                               {"images", is_image_folder, open_image_folder}};

std::string format_names() {
    return joined(kFormats, &Format::name);
}

Result<const Format*> format_of(const DatasetDesc& desc) {
    if (!desc.format.empty()) {
        for (const Format& format : kFormats)
            if (desc.format == format.name) return &format;
        return invalid("format is '%s', expected one of %s", desc.format.c_str(),
                       format_names().c_str());
    }
    SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(desc.path));
    if (kind == io::PathKind::kNothing)
        return not_found("there is no folder '%s'", shown(desc.path, os::kLongestPath).c_str());
    Status unreadable;  // by one format; another may not ask for that
    for (const Format& format : kFormats) {
        if (kind != io::PathKind::kFolder) break;
        const auto holds = format.holds(desc.path);
        if (holds.ok() && holds.value()) return &format;
        if (!holds.ok() && unreadable.ok()) unreadable = holds.status();
    }
    SPLAT_TRY(unreadable);
    const std::string lack = kind == io::PathKind::kFolder ? lack_of_cameras(desc.path) : "";
    if (!lack.empty())
        return damaged("'%s' is not a data set of a known format: %s",
                       shown(desc.path, os::kLongestPath).c_str(), lack.c_str());
    return damaged("'%s' is not a data set of a known format (%s); if it is one, name its format",
                   shown(desc.path, os::kLongestPath).c_str(), format_names().c_str());
}

std::string map_list(std::uint32_t maps) {
    std::string names;
    for (const MapKind kind : kMaps)
        if ((maps & flag_of(kind)) != 0)
            names += (names.empty() ? "" : ", ") + std::string(map_name(kind));
    return names.empty() ? "none" : names;
}

Status check_maps(std::uint32_t wanted, const DatasetIndex& index) {
    if ((wanted & ~index.maps) == 0) return {};
    std::string places;
    for (const MapKind kind : kMaps)
        if ((wanted & flag_of(kind)) != 0 && !index.lacking(kind).empty())
            places += "; missing: '" + index.lacking(kind) + "'";
    if (!index.unread.empty()) places += "; " + index.unread_note();
    const std::string remedy = index.plane_remedy();
    if ((wanted & flag_of(MapKind::kPlane)) != 0 && !remedy.empty()) places += "; " + remedy;
    return not_found("maps requested: %s; every object has: %s%s", map_list(wanted).c_str(),
                     map_list(index.maps).c_str(), places.c_str());
}

/// Tells what is left out: objects, folders, maps, and parts of images, which are used at `used` pixels a side.
void warn_of_gaps(const std::string& path, const DatasetIndex& index, std::uint32_t used) {
    const auto warn = [&](const char* what, const std::vector<std::string>& names) {
        constexpr std::size_t kNamed = 10;
        if (names.empty()) return;
        std::string list;
        for (std::size_t i = 0; i < names.size() && i < kNamed; ++i)
            list += (i == 0 ? "'" : ", '") + shown(names[i]) + "'";
        if (names.size() > kNamed) list += format(" and %zu more", names.size() - kNamed);
        log(LogLevel::kWarning, format("'%s', %s: %zu %s: %s", path.c_str(), index.split.c_str(),
                                       names.size(), what, list.c_str()));
    };
    std::vector<std::string> missing;
    for (const auto& [name, problem] : index.missing) missing.push_back(name);
    warn("incomplete objects are left out", missing);
    warn("folders without a part of an object are not read", index.others);
    const std::string place =
        "'" + path + "'" + (index.has_splits ? ", " + index.split : std::string());
    for (const std::string& note : {index.unread_note(), index.crop_note(used)})
        if (!note.empty()) log(LogLevel::kWarning, place + ": " + note);
}

/// The file as the desc names it, or in the folder of the data.
std::string list_path(const std::string& file, const std::string& folder) {
    std::error_code none;
    const std::filesystem::path beside = os::path_of(folder) / file;
    const bool in_folder =
        !std::filesystem::exists(os::path_of(file), none) && std::filesystem::exists(beside, none);
    return file.empty() || !in_folder ? file : os::text_of(beside);
}

/// Each list belongs to one format.
Result<ReaderDesc> reader_desc(const DatasetDesc& desc, const char* format) {
    ReaderDesc reader = desc;
    const struct {
        const char* name;
        const char* format;
        std::string& path;
    } lists[] = {{"objects_file", "objaverse", reader.objects_file},
                 {"excluded_file", "co3d", reader.excluded_file},
                 {"views_file", "nmr", reader.views_file}};
    for (const auto& list : lists) {
        if (!list.path.empty() && std::string(format) != list.format)
            return invalid(
                "%s is '%s', expected none: it is for data of the format %s, and '%s' is %s",
                list.name, list.path.c_str(), list.format, desc.path.c_str(), format);
        list.path = list_path(list.path, desc.path);
    }
    return reader;
}

/// 8-bit samples of `channels` channels: gray is repeated, transparent pixels show the background unless
/// `as_stored`.
std::vector<std::uint8_t> flattened(const io::Image& image, std::uint32_t channels,
                                    const std::array<float, 3>& background, bool as_stored) {
    const bool has_alpha = image.channels == 2 || image.channels == 4;
    const std::uint32_t colors = image.channels - (has_alpha ? 1 : 0);
    const std::size_t count = std::size_t{image.width} * image.height;
    std::vector<std::uint8_t> out(count * channels);
    if (!has_alpha && colors == channels) {
        std::ranges::transform(image.samples, out.begin(), [](std::uint16_t sample) {
            return static_cast<std::uint8_t>(sample);
        });
        return out;
    }
    for (std::size_t i = 0; i < count; ++i) {
        const std::uint16_t* from = &image.samples[i * image.channels];
        const double alpha = has_alpha && !as_stored ? from[image.channels - 1] / 255.0 : 1;
        for (std::uint32_t c = 0; c < channels; ++c) {
            const double value = from[std::min(c, colors - 1)];
            const double behind = 255.0 * static_cast<double>(background[c]);
            out[i * channels + c] = io::to_byte(alpha * value + (1 - alpha) * behind);
        }
    }
    return out;
}

/// The samples of a map at the nearest pixels: means of numbers of two planes would be those of a third one.
Result<std::vector<std::uint8_t>> nearest_samples(const io::Image& map, std::uint32_t side) {
    SPLAT_ASSIGN(const std::vector<double> samples,
                 resample_values<std::uint16_t>(map.samples, map.width, map.height, map.channels,
                                                side, side, ValueFilter::kNearest));
    std::vector<std::uint8_t> bytes;
    bytes.reserve(samples.size());
    for (const double sample : samples) bytes.push_back(static_cast<std::uint8_t>(sample));
    return bytes;
}

}  // namespace

Dataset::Dataset(const DatasetDesc& desc, std::unique_ptr<DatasetReader> reader)
    : reader_(std::move(reader)),
      resolution_(desc.resolution != 0 ? desc.resolution : reader_->index().resolution),
      background_(desc.background),
      cache_(desc.cache_bytes != 0 ? desc.cache_bytes : kDefaultCache),
      cameras_(reader_->index().names.size() <= kMostListed ? reader_->index().names.size() : 0) {}

Result<std::unique_ptr<Dataset>> Dataset::open(const DatasetDesc& desc) {
    SPLAT_TRY(check_split(desc.split));
    if (desc.resolution > kMaxResolution)
        return invalid("resolution is %u, expected at most %u", desc.resolution, kMaxResolution);
    for (const float value : desc.background)
        if (!(value >= 0 && value <= 1))
            return invalid("background is %g, expected 0 to 1", static_cast<double>(value));
    SPLAT_ASSIGN(const Format* format, format_of(desc));
    SPLAT_ASSIGN(const ReaderDesc wanted, reader_desc(desc, format->name));
    SPLAT_ASSIGN(auto reader, format->open(wanted));
    if (desc.lacks_split != nullptr && !reader->index().has_splits)
        return no_split(wanted, not_found("'%s' has no splits: its objects are those of any split",
                                          desc.path.c_str()));
    SPLAT_TRY(check_maps(desc.maps, reader->index()));
    std::unique_ptr<Dataset> dataset(new Dataset(desc, std::move(reader)));
    if (!desc.lenient) warn_of_gaps(desc.path, dataset->index(), dataset->resolution());
    return dataset;
}

Result<Dataset::Views> Dataset::cameras(std::uint32_t object) {
    const bool kept = !cameras_.empty();
    if (kept) {
        const std::lock_guard lock(mutex_);
        if (cameras_[object] != nullptr) return cameras_[object];
    }
    SPLAT_ASSIGN(std::vector<StoredView> found, reader_->cameras(object));
    auto views = std::make_shared<const std::vector<StoredView>>(std::move(found));
    if (!kept) return Views(views);
    const std::lock_guard lock(mutex_);
    cameras_[object] = views;
    return Views(views);
}

Status Dataset::read_cameras() {
    const auto objects = static_cast<std::uint32_t>(index().names.size());
    const std::uint32_t stride = check_stride(objects);
    for (std::uint32_t object = 0; object < objects; object += stride)
        SPLAT_TRY(cameras(object).status());
    return {};
}

Result<ImageCache::Pixels> Dataset::pixels(std::uint32_t object, std::uint32_t view, MapKind kind) {
    const std::uint64_t key = (std::uint64_t{object} << 32) | (std::uint64_t{view} << 3) |
                              static_cast<std::uint32_t>(kind);
    if (ImageCache::Pixels found = cache_.find(key)) return found;
    SPLAT_ASSIGN(io::Image image, reader_->map(object, view, kind));
    std::vector<std::uint8_t> flat;
    if (kind == MapKind::kPlane) {
        SPLAT_SET(flat, nearest_samples(image, resolution_));
    } else {
        if (image.width != resolution_ || image.height != resolution_)
            SPLAT_SET(image, resample(image, resolution_, resolution_, index().filter));
        flat = flattened(image, channels_of(kind), background_, index().ignores_alpha);
    }
    auto pixels = std::make_shared<const std::vector<std::uint8_t>>(std::move(flat));
    cache_.add(key, pixels);
    return ImageCache::Pixels(pixels);
}

Status Dataset::read_map(std::uint32_t object, std::span<const std::uint32_t> views, MapKind kind,
                         float* out, std::uint8_t* levels) {
    if (out == nullptr && levels == nullptr) return {};
    if (kind != MapKind::kRgb) SPLAT_TRY(check_maps(flag_of(kind), index()));
    const std::size_t channels = channels_of(kind);
    const std::size_t area = std::size_t{resolution_} * resolution_;
    std::array<float, 256> floats{};
    for (std::size_t i = 0; i < floats.size(); ++i) floats[i] = static_cast<float>(i) / 255.0F;
    for (const std::uint32_t view : views) {
        SPLAT_ASSIGN(const ImageCache::Pixels image, pixels(object, view, kind));
        for (std::size_t c = 0; c < channels; ++c)
            for (std::size_t i = 0; i < area; ++i) {
                const std::uint8_t level = (*image)[i * channels + c];
                if (out != nullptr) *out++ = floats[level];
                if (levels != nullptr) *levels++ = level;
            }
    }
    return {};
}

Status Dataset::read_planes(std::uint32_t object, std::span<const std::uint32_t> views,
                            float* out) {
    if (out == nullptr) return {};
    SPLAT_TRY(check_maps(flag_of(MapKind::kPlane), index()));
    const std::size_t numbers = std::size_t{kPlaneChannels} * resolution_ * resolution_;
    for (const std::uint32_t view : views) {
        SPLAT_ASSIGN(const ImageCache::Pixels map, pixels(object, view, MapKind::kPlane));
        plane_channels(*map, {out, numbers});
        out += numbers;
    }
    return {};
}

Status Dataset::read_cameras(std::uint32_t object, std::span<const std::uint32_t> views,
                             const ViewArrays& out) {
    SPLAT_ASSIGN(const Views stored, cameras(object));
    std::vector<scene::Mat4> poses;
    for (const std::uint32_t view : views) poses.push_back((*stored)[view].camera_to_world);
    if (index().source_distance != 0 && !poses.empty())
        SPLAT_TRY(scale_to_distance(index().source_distance, poses));
    SPLAT_ASSIGN(const std::vector<RelativeView> relative, relative_views(poses));
    for (std::size_t i = 0; i < views.size(); ++i) {
        const StoredView& view = (*stored)[views[i]];
        if (out.view_to_world != nullptr)
            std::ranges::copy(relative[i].view_to_world, out.view_to_world + i * 16);
        if (out.quaternions != nullptr)
            std::ranges::copy(relative[i].quaternion, out.quaternions + i * 4);
        if (out.focals != nullptr) {
            out.focals[i * 2] = static_cast<float>(view.focal_x * resolution_);
            out.focals[i * 2 + 1] = static_cast<float>(view.focal_y * resolution_);
        }
        if (out.origin_distances != nullptr)
            out.origin_distances[i] = static_cast<float>(view.origin_distance);
    }
    return {};
}

Status Dataset::read(std::uint32_t object, std::span<const std::uint32_t> views,
                     const ViewArrays& out) {
    const DatasetIndex& all = index();
    if (object >= all.names.size())
        return invalid("object is %u, expected less than %zu, the number of objects", object,
                       all.names.size());
    for (const std::uint32_t view : views)
        if (view >= all.views_of[object])
            return invalid("view is %u, but object %u ('%s') has %u views", view, object,
                           all.names[object].c_str(), all.views_of[object]);
    SPLAT_TRY(read_cameras(object, views, out));
    SPLAT_TRY(read_map(object, views, MapKind::kRgb, out.images, out.levels));
    SPLAT_TRY(read_map(object, views, MapKind::kDepth, out.depths));
    SPLAT_TRY(read_map(object, views, MapKind::kNormal, out.normals));
    SPLAT_TRY(read_map(object, views, MapKind::kMask, out.masks));
    return read_planes(object, views, out.planes);
}

}  // namespace splat::data
