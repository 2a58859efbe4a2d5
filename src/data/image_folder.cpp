#include "data/image_folder.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/json_tree.h"
#include "core/log.h"
#include "core/os/path.h"
#include "core/path_name.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/formats.h"
#include "data/map_files.h"
#include "io/colmap.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/photo/image_file.h"
#include "io/reader.h"
#include "io/transforms_json.h"

namespace splat::data {
namespace fs = std::filesystem;

Result<std::string> image_path(const fs::path& folder, const std::string& name) {
    SPLAT_TRY(in_file(check_portable(name), os::text_of(folder)));
    for (const char* below : {"", "images"})
        for (const char* extension : {"", ".png", ".jpg", ".jpeg", ".webp", ".pgm", ".ppm"}) {
            const fs::path path = folder / below / (name + extension);
            SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(path)));
            if (is_there) return os::text_of(path);
        }
    return not_found("'%s': there is no image '%s', here or in images/",
                     os::text_of(folder).c_str(), shown(name).c_str());
}

namespace {

constexpr std::uint64_t kMaxCameraBytes = 16U << 20;

/// The size of the first image of a transforms.json, whose own size is optional.
Result<io::Image> first_image(const fs::path& folder, std::string_view text) {
    SPLAT_ASSIGN(const JsonTree tree, io::from_file(parse_json_tree(text, "transforms.json")));
    const JsonTree::List& frames = tree["frames"].items();
    if (frames.empty()) return damaged("there are no frames");
    const std::string* const name = frames.front()["file_path"].text();
    if (name == nullptr) return damaged("frame 0 has no file_path");
    SPLAT_ASSIGN(const std::string path, image_path(folder, *name));
    return load_bytes(os::path_of(path), {.header_only = true});
}

/// Pixels; 0: not known.
Result<double> exif_focal(const fs::path& folder, const std::string& name) {
    SPLAT_ASSIGN(const std::string path, image_path(folder, name));
    SPLAT_ASSIGN(const io::Image image, io::load_image(path, {.header_only = true}));
    return image.focal;
}

}  // namespace

Result<io::CameraSet> load_transforms(const fs::path& folder, const fs::path& file,
                                      io::CameraOptions options) {
    SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(os::text_of(file), kMaxCameraBytes));
    const auto first = in_file(first_image(folder, io::as_text(bytes)), os::text_of(file));
    Status unreadable;
    options.focal = [&](const std::string& name) {
        const auto focal = exif_focal(folder, name);
        if (!focal.ok() && focal.status().code() == Code::kIo) unreadable = focal.status();
        return focal.ok() ? focal.value() : 0;
    };
    const io::Image size = first.ok() ? first.value() : io::Image();
    auto cameras = io::read_transforms_json(bytes, size.width, size.height, options);
    SPLAT_TRY(unreadable);
    if (cameras.ok()) return cameras;
    return first.ok() ? in_file(cameras.status(), os::text_of(file)) : first.status();
}

namespace {

/// A camera with its image, and the square of it that is used.
struct FolderPhoto {
    fs::path folder;  ///< folder of the object
    std::string path;
    StoredView view;
    std::uint32_t width = 0, height = 0;
    std::uint32_t left = 0, top = 0, side = 0;
    std::array<std::string, kImageKinds> maps;  ///< by MapKind; those that the cameras' file names
};

using FolderPhotos = std::vector<FolderPhoto>;

/// The folder has one of the files.
Result<bool> has_any(const fs::path& folder, std::vector<std::string> files) {
    for (const char* model : io::kColmapFolders)
        for (const char* file : {"cameras.bin", "cameras.txt"})
            files.push_back(os::text_of(os::path_of(model) / file));
    return io::holds_for_any(files, [&folder](const std::string& name) {
        return io::has_file(os::text_of(folder / name));
    });
}

Result<bool> has_cameras(const fs::path& folder) {
    return has_any(folder, {"transforms.json", "transforms_train.json", "transforms_val.json",
                            "transforms_test.json"});
}

Result<bool> has_cameras_of(const fs::path& folder, const std::string& split) {
    return has_any(folder, {"transforms_" + split + ".json", "transforms.json"});
}

/// Some folder in it has cameras.
Result<bool> has_objects(const fs::path& folder) {
    const auto names = io::folders_in(os::text_of(folder));
    if (names.status().code() == Code::kNotFound) return false;
    if (!names.ok()) return names.status();
    return io::holds_for_any(
        names.value(), [&folder](const std::string& name) { return has_cameras(folder / name); });
}

/// Files of cameras of a split, the first of which counts; without any, a COLMAP model.
std::vector<std::string> transforms_names(const std::string& split) {
    return {"transforms_" + split + ".json", "transforms.json"};
}

Result<io::CameraSet> load_cameras(const fs::path& folder, const std::string& split) {
    for (const std::string& name : transforms_names(split)) {
        SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(folder / name)));
        if (!is_there) continue;
        auto cameras = load_transforms(folder, folder / name);
        if (!cameras.ok()) return cameras;
        for (const std::string& warning : cameras.value().warnings)
            log(LogLevel::kWarning,
                format("'%s': %s", os::text_of(folder / name).c_str(), warning.c_str()));
        return cameras;
    }
    return io::load_colmap(os::text_of(folder));
}

/// A camera with the maps that its file names.
struct ListedCamera {
    scene::Camera camera;
    io::CameraMaps maps;
};

/// The cameras of a split, by name; none if their file lists others only. Errors: kFormat for a name without camera.
Result<std::vector<ListedCamera>> listed_cameras(const io::CameraSet& set,
                                                 const std::string& split) {
    std::set<std::string> names, found;
    if (const auto list = set.splits.find(split); list != set.splits.end())
        names.insert(list->second.begin(), list->second.end());
    std::vector<ListedCamera> listed;
    for (std::size_t i = 0; i < set.cameras.size(); ++i) {
        if (!set.splits.empty() && !names.contains(set.cameras[i].name)) continue;
        found.insert(set.cameras[i].name);
        listed.push_back({set.cameras[i], set.maps.empty() ? io::CameraMaps() : set.maps[i]});
    }
    for (const std::string& name : names)
        if (!found.contains(name))
            return damaged("%s_filenames has '%s', which no frame has", split.c_str(),
                           shown(name).c_str());
    std::ranges::sort(listed,
                      [](const auto& a, const auto& b) { return a.camera.name < b.camera.name; });
    return listed;
}

/// The paths of the maps that a file of cameras names; empty where it names none. Errors: kNotFound.
Result<std::array<std::string, kImageKinds>> named_maps(const fs::path& folder,
                                                        const io::CameraMaps& maps) {
    std::array<std::string, kImageKinds> paths;
    for (const auto& [kind, name] :
         {std::pair{MapKind::kMask, &maps.mask}, {MapKind::kDepth, &maps.depth}}) {
        if (name->empty()) continue;
        SPLAT_TRY(in_file(check_portable(*name), os::text_of(folder)));
        const fs::path path = folder / *name;
        SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(path)));
        if (!is_there)
            return not_found("'%s': there is no %s map '%s'", os::text_of(folder).c_str(),
                             map_name(kind), shown(*name).c_str());
        paths[static_cast<std::size_t>(kind)] = os::text_of(path);
    }
    return paths;
}

/// Flags of the maps that all photographs name. Errors: kFormat if some of them do.
Result<std::uint32_t> maps_named_by_all(const FolderPhotos& photos) {
    std::uint32_t given = 0;
    for (const MapKind kind : kMaps) {
        const auto lacks = [kind](const FolderPhoto& photo) {
            return photo.maps[static_cast<std::size_t>(kind)].empty();
        };
        const auto without = std::ranges::find_if(photos, lacks);
        if (without == photos.end() && !photos.empty()) given |= flag_of(kind);
        if (without != photos.end() && !std::ranges::all_of(photos, lacks))
            return damaged("'%s' has no %s map, though other frames name theirs",
                           without->path.c_str(), map_name(kind));
    }
    return given;
}

Result<FolderPhoto> photograph_of(const fs::path& folder, const ListedCamera& listed) {
    const scene::Camera& camera = listed.camera;
    FolderPhoto photo;
    photo.folder = folder;
    SPLAT_ASSIGN(photo.maps, named_maps(folder, listed.maps));
    SPLAT_ASSIGN(photo.path, image_path(folder, camera.name));
    const double half =
        std::min({camera.cx, camera.width - camera.cx, camera.cy, camera.height - camera.cy});
    if (!(half >= 1))
        return damaged("camera '%s': the principal point is not in the image",
                       shown(camera.name).c_str());
    photo.width = camera.width;
    photo.height = camera.height;
    photo.side = static_cast<std::uint32_t>(std::floor(2 * half));
    const auto start = [&photo](double center, std::uint32_t size) {
        const double first = std::round(center - photo.side / 2.0);
        return static_cast<std::uint32_t>(std::clamp(first, 0.0, double{1} * (size - photo.side)));
    };
    photo.left = start(camera.cx, camera.width);
    photo.top = start(camera.cy, camera.height);
    SPLAT_ASSIGN(photo.view.camera_to_world, inverse_pose(camera.world_to_camera));
    photo.view.focal_x = camera.fx / photo.side;
    photo.view.focal_y = camera.fy / photo.side;
    return photo;
}

/// The folder that holds the objects: one of the split's name, if that or another split's does.
Result<fs::path> root_of_split(const fs::path& folder, const std::string& split) {
    SPLAT_ASSIGN(const bool is_object, has_cameras(folder));
    SPLAT_ASSIGN(const io::PathKind below, io::kind_of(os::text_of(folder / split)));
    SPLAT_TRY(check_link(below, folder / split));
    if (is_object || below != io::PathKind::kFolder) return folder;
    SPLAT_ASSIGN(const bool has_splits,
                 io::holds_for_any({split, "train", "val", "test"}, [&](const std::string& name) {
                     return has_objects(folder / name);
                 }));
    return has_splits ? folder / split : folder;
}

/// What may be objects: the root itself, or the folders in it.
Result<std::vector<fs::path>> objects_in(const fs::path& root) {
    SPLAT_ASSIGN(const bool is_object, has_cameras(root));
    if (is_object) return std::vector<fs::path>{root};
    SPLAT_ASSIGN(const std::vector<std::string> names, candidates_in(root));
    std::vector<fs::path> folders;
    for (const std::string& name : names) folders.push_back(root / name);
    return folders;
}

/// Pictures lie in the folder, or in images/.
Result<bool> has_pictures(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> here, images_in(folder));
    SPLAT_ASSIGN(const std::vector<std::string> below, images_in(folder / "images"));
    return !here.empty() || !below.empty();
}

bool lies_outside(const fs::path& path, const fs::path& folder) {
    const fs::path way = path.lexically_normal().lexically_relative(folder.lexically_normal());
    return way.empty() || *way.begin() == "..";
}

/// The last name of a path, also of "lego/" and ".".
std::string name_of(const fs::path& folder) {
    std::error_code failed;
    const fs::path whole = fs::absolute(folder, failed).lexically_normal();
    return os::text_of((whole.has_filename() ? whole : whole.parent_path()).filename());
}

class ImageFolderReader : public ObjectsReader<FolderPhotos> {
  public:
    explicit ImageFolderReader(const ReaderDesc& desc)
        : ObjectsReader("images", desc, Filter::kLanczos) {}

    Status open() {
        const fs::path given = os::path_of(desc_.path);
        SPLAT_ASSIGN(const fs::path root, root_of_split(given, desc_.split));
        index_.has_splits = root != given;
        SPLAT_ASSIGN(const std::vector<fs::path> folders, objects_in(root));
        // What cannot be read, take() refuses, and in a split's own folder what has no cameras.
        const auto may = [](const Result<bool>& found) { return !found.ok() || found.value(); };
        bool is_there = false;
        std::vector<fs::path> with_cameras;
        for (const fs::path& folder : folders) {
            const auto posed = has_cameras(folder);
            if (posed.ok() && posed.value()) with_cameras.push_back(folder);
            is_there = is_there || may(has_cameras_of(folder, desc_.split)) ||
                       !io::entries_in(os::text_of(folder)).ok() ||
                       (index_.has_splits && may(has_pictures(folder)));
        }
        if (!is_there)
            return no_split(desc_,
                            not_found("'%s' holds neither transforms.json nor transforms_%s.json "
                                      "nor a COLMAP model",
                                      os::text_of(root).c_str(), desc_.split.c_str()));
        if (!index_.has_splits) find_splits(with_cameras);
        for (const fs::path& folder : folders) {
            if (is_full()) break;
            const std::string name = name_of(folder);
            SPLAT_TRY(take(name, folder, [&] { return add(folder, name); }));
        }
        for (const std::string& name : of_other_splits_) std::erase(index_.others, name);
        if (objects_.empty() && !of_other_splits_.empty())
            return no_split(desc_, not_found("'%s' lists no frames as %s_filenames",
                                             os::text_of(root).c_str(), desc_.split.c_str()));
        return index_.find_resolution(*this, desc_.lenient);
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        std::vector<StoredView> views;
        for (const FolderPhoto& photo : objects_[object]) views.push_back(photo.view);
        return views;
    }

    /// Reads the points of a COLMAP model; empty if a transforms file gives the cameras.
    [[nodiscard]] Result<std::vector<scene::Vec3>> points(std::uint32_t object) const override {
        const fs::path folder = os::path_of(index_.folders[object]);
        for (const std::string& name : transforms_names(index_.split)) {
            SPLAT_ASSIGN(const bool is_there, io::has_file(os::text_of(folder / name)));
            if (is_there) return std::vector<scene::Vec3>();
        }
        SPLAT_ASSIGN(io::ColoredPoints found, io::load_colmap_points(os::text_of(folder)));
        return std::move(found.positions);
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const FolderPhoto& photo = objects_[object][view];
        fs::path path = os::path_of(
            kind == MapKind::kRgb ? photo.path : photo.maps[static_cast<std::size_t>(kind)]);
        const DepthNumbers numbers =
            path.empty() ? DepthNumbers::kNearness : DepthNumbers::kDistance;
        if (path.empty())
            SPLAT_SET(path,
                      map_file(photo.folder, kind, os::text_of(os::path_of(photo.path).stem())));
        const auto load = [&](const io::ImageOptions& options) {
            return kind == MapKind::kRgb ? load_bytes(path, options)
                                         : load_map(path, kind, options, numbers);
        };
        SPLAT_ASSIGN(io::Image whole, load({.header_only = true}));
        if (whole.width != photo.width || whole.height != photo.height)
            return damaged("'%s': %u x %u pixels, its camera has %u x %u",
                           os::text_of(path).c_str(), whole.width, whole.height, photo.width,
                           photo.height);
        io::Image square{photo.side, photo.side, whole.channels, 8, {}};
        if (header_only) return square;
        SPLAT_ASSIGN(whole, load({}));
        const std::size_t row = std::size_t{photo.side} * whole.channels;
        for (std::size_t y = 0; y < photo.side; ++y) {
            const std::size_t start = ((photo.top + y) * whole.width + photo.left) * whole.channels;
            const auto from = whole.samples.begin() + static_cast<std::ptrdiff_t>(start);
            square.samples.insert(square.samples.end(), from,
                                  from + static_cast<std::ptrdiff_t>(row));
        }
        return square;
    }

  private:
    /// Objects have splits if each has cameras of its own for this one.
    void find_splits(const std::vector<fs::path>& folders) {
        const std::string name = "transforms_" + desc_.split + ".json";
        const auto has = [&name](const fs::path& folder) {
            const auto own = io::has_file(os::text_of(folder / name));
            return own.ok() && own.value();
        };
        const auto without = std::ranges::find_if_not(folders, has);
        index_.has_splits = without == folders.end();
        if (!index_.has_splits && std::ranges::any_of(folders, has))
            log(LogLevel::kWarning,
                format("'%s' has no %s, which other objects have; the data set counts as one "
                       "without splits",
                       os::text_of(*without).c_str(), name.c_str()));
    }

    Result<bool> add(const fs::path& folder, const std::string& name) {
        SPLAT_TRY(io::entries_in(os::text_of(folder)).status());
        SPLAT_ASSIGN(const bool is_posed, has_cameras(folder));
        SPLAT_ASSIGN(const bool is_pictured, has_pictures(folder));
        if (!is_posed && !is_pictured) return false;
        if (!is_posed)
            return damaged("'%s' has pictures, but neither transforms.json nor a COLMAP model",
                           os::text_of(folder).c_str());
        SPLAT_ASSIGN(const io::CameraSet set, load_cameras(folder, desc_.split));
        if (!set.splits.empty()) index_.has_splits = true;
        const auto own = set.splits.find(desc_.split);
        if (!set.splits.empty() && (own == set.splits.end() || own->second.empty())) {
            of_other_splits_.push_back(name);
            return false;
        }
        SPLAT_ASSIGN(const auto listed,
                     in_file(listed_cameras(set, desc_.split), os::text_of(folder)));
        FolderPhotos photos;
        ViewNames names;
        std::vector<std::string> problems;
        Crop crop = index_.crop;
        for (const ListedCamera& camera : listed) {
            auto photo = photograph_of(folder, camera);
            if (!photo.ok() && !desc_.lenient) return photo.status();
            if (!photo.ok()) {
                problems.push_back(photo.status().message());
                continue;
            }
            photos.push_back(std::move(photo.value()));
            crop.add(photos.back().width, photos.back().height, photos.back().side);
            names.cameras.push_back(camera.camera.name);
            if (lies_outside(os::path_of(photos.back().path), folder))
                index_.files.push_back(photos.back().path);
        }
        names.images = names.cameras;
        SPLAT_TRY(index_.add(name, os::text_of(folder), names, desc_.lenient).status());
        objects_.push_back(photos);
        index_.problems.back().insert(index_.problems.back().end(), problems.begin(),
                                      problems.end());
        std::vector<std::string> stems;
        for (const FolderPhoto& photo : objects_.back())
            stems.push_back(os::text_of(os::path_of(photo.path).stem()));
        SPLAT_ASSIGN(const std::uint32_t given, maps_named_by_all(objects_.back()));
        SPLAT_TRY(find_map_files(folder, stems, desc_.lenient, index_, given));
        index_.crop = crop;
        return true;
    }

    std::vector<std::string> of_other_splits_;  ///< objects whose file lists frames of others only
};

}  // namespace

Result<bool> is_image_folder(const std::string& path) {
    SPLAT_ASSIGN(const bool is_object, has_cameras(os::path_of(path)));
    if (is_object) return true;
    return io::holds_for_any({"", "train", "val", "test"}, [&path](const std::string& name) {
        return has_objects(os::path_of(path) / name);
    });
}

std::string lack_of_cameras(const std::string& path) {
    const fs::path folder = os::path_of(path);
    std::vector<fs::path> places = {folder, folder / "images"};
    const auto names = candidates_in(folder);
    for (const std::string& name : names.ok() ? names.value() : std::vector<std::string>())
        for (const fs::path& place : {folder / name, folder / name / "images"})
            places.push_back(place);
    for (const fs::path& place : places) {
        const auto pictures = images_in(place);
        if (pictures.ok() && !pictures.value().empty())
            return format(
                "'%s' holds %zu pictures, but there are no cameras, which a data set needs: "
                "transforms.json (as NeRF's), or a COLMAP model (cameras.bin and images.bin, or "
                "as .txt; also in sparse/0 or sparse), beside them or beside images/. COLMAP finds "
                "the cameras of photographs of one scene; docs/your-data.md has the commands",
                os::text_of(place).c_str(), pictures.value().size());
    }
    for (const fs::path& place : places) {
        const auto entries = io::entries_in(os::text_of(place));
        if (!entries.ok()) continue;
        for (const io::FolderEntry& entry : entries.value()) {
            const std::string file = os::text_of(place / entry.name);
            const std::string other =
                io::has_extension(file, {".heic", ".heif", ".avif", ".tif", ".tiff", ".jxl"})
                    ? io::unread_image_file(file)
                    : "";
            if (!other.empty()) return format("'%s' is %s", file.c_str(), other.c_str());
        }
    }
    return "";
}

Result<std::unique_ptr<DatasetReader>> open_image_folder(const ReaderDesc& desc) {
    return opened<ImageFolderReader>(desc);
}

}  // namespace splat::data
