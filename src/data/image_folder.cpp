#include "data/image_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/json_tree.h"
#include "core/log.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/map_files.h"
#include "io/colmap.h"
#include "io/file.h"
#include "io/photo/image_file.h"
#include "io/reader.h"
#include "io/transforms_json.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxCameraBytes = 16U << 20;

/// A camera with its image, and the square of it that is used.
struct FolderPhoto {
    fs::path folder;  ///< of the object
    std::string path;
    StoredView view;
    std::uint32_t width = 0, height = 0;
    std::uint32_t left = 0, top = 0, side = 0;
};

using FolderPhotos = std::vector<FolderPhoto>;

bool has_colmap(const fs::path& folder) {
    for (const char* below : {"", "sparse/0"})
        for (const char* name : {"cameras.bin", "cameras.txt"})
            if (is_file(folder / below / name)) return true;
    return false;
}

bool has_transforms(const fs::path& folder) {
    for (const char* name : {"transforms.json", "transforms_train.json", "transforms_val.json",
                             "transforms_test.json"})
        if (is_file(folder / name)) return true;
    return false;
}

bool has_cameras(const fs::path& folder) {
    return has_transforms(folder) || has_colmap(folder);
}

bool has_cameras_of(const fs::path& folder, const std::string& split) {
    return is_file(folder / ("transforms_" + split + ".json")) ||
           is_file(folder / "transforms.json") || has_colmap(folder);
}

/// Some folder in it has cameras.
bool has_objects(const fs::path& folder) {
    for (const std::string& name : folders_in(folder))
        if (has_cameras(folder / name)) return true;
    return false;
}

/// The file that a camera names: as given, in images/, or with the extension added.
Result<std::string> image_path(const fs::path& folder, const std::string& name) {
    for (const char* below : {"", "images"})
        for (const char* extension : {"", ".png", ".jpg", ".jpeg", ".webp"}) {
            const fs::path path = folder / below / (name + extension);
            if (is_file(path)) return path.string();
        }
    return error(Code::kNotFound, "'%s': there is no image '%s', here or in images/",
                 folder.c_str(), shown(name).c_str());
}

/// The size of the first image of a transforms.json, whose own size is optional.
Result<io::Image> first_image(const fs::path& folder, std::string_view text) {
    SPLAT_ASSIGN(const JsonTree tree, io::from_file(parse_json_tree(text, "transforms.json")));
    const JsonTree* frames = tree.find("frames");
    const JsonTree::List* list = frames == nullptr ? nullptr : frames->list();
    if (list == nullptr || list->empty()) return error(Code::kFormat, "there are no frames");
    const JsonTree* name = list->front().find("file_path");
    if (name == nullptr || name->text() == nullptr)
        return error(Code::kFormat, "frame 0 has no file_path");
    SPLAT_ASSIGN(const std::string path, image_path(folder, *name->text()));
    return load_bytes(path, {.header_only = true});
}

/// Pixels; 0: not known, or there is no such image.
double exif_focal(const fs::path& folder, const std::string& name) {
    const auto path = image_path(folder, name);
    if (!path.ok()) return 0;
    io::ImageOptions header;
    header.header_only = true;
    const auto image = io::load_image(path.value(), header);
    return image.ok() ? image.value().focal : 0;
}

Result<io::CameraSet> load_transforms(const fs::path& folder, const fs::path& file) {
    SPLAT_ASSIGN(const io::Buffer bytes, io::read_file(file.string(), kMaxCameraBytes));
    const auto first = first_image(folder, io::as_text(bytes));
    if (!first.ok())  // the split is there
        return in_file(error(Code::kFormat, "%s", first.status().message().c_str()), file.string());
    io::CameraOptions options;
    options.focal = [&folder](const std::string& name) { return exif_focal(folder, name); };
    auto cameras =
        io::read_transforms_json(bytes, first.value().width, first.value().height, options);
    if (!cameras.ok()) return in_file(cameras.status(), file.string());
    for (const std::string& warning : cameras.value().warnings)
        log(LogLevel::kWarning, format("'%s': %s", file.c_str(), warning.c_str()));
    return cameras;
}

Result<io::CameraSet> load_cameras(const fs::path& folder, const std::string& split) {
    for (const std::string& name :
         {"transforms_" + split + ".json", std::string("transforms.json")})
        if (is_file(folder / name)) return load_transforms(folder, folder / name);
    return io::load_colmap(folder.string());
}

Result<FolderPhoto> photograph_of(const fs::path& folder, const scene::Camera& camera) {
    FolderPhoto photo;
    photo.folder = folder;
    SPLAT_ASSIGN(photo.path, image_path(folder, camera.name));
    const double half =
        std::min({camera.cx, camera.width - camera.cx, camera.cy, camera.height - camera.cy});
    if (!(half >= 1))
        return error(Code::kFormat, "camera '%s': the principal point is not in the image",
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

/// The folder that holds the objects: one of the split's name, if that does.
fs::path root_of_split(const fs::path& folder, const std::string& split) {
    return !has_cameras(folder) && has_objects(folder / split) ? folder / split : folder;
}

/// Folders of objects: the root itself, or those in it.
std::vector<fs::path> objects_in(const fs::path& root) {
    if (has_cameras(root)) return {root};
    std::vector<fs::path> folders;
    for (const std::string& name : folders_in(root))
        if (has_cameras(root / name)) folders.push_back(root / name);
    return folders;
}

bool lies_outside(const fs::path& path, const fs::path& folder) {
    const fs::path way = path.lexically_normal().lexically_relative(folder.lexically_normal());
    return way.empty() || *way.begin() == "..";
}

/// The last name of a path, also of "lego/" and ".".
std::string name_of(const fs::path& folder) {
    std::error_code failed;
    const fs::path whole = fs::absolute(folder, failed).lexically_normal();
    return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

class ImageFolderReader : public DatasetReader {
  public:
    Status open(const ReaderDesc& desc) {
        index_.format = "images";
        index_.split = desc.split;
        index_.filter = Filter::kLanczos;
        index_.maps = kAllMaps;
        const fs::path root = root_of_split(desc.path, desc.split);
        bool is_there = false;
        index_.has_splits = root != desc.path;
        const std::vector<fs::path> folders = objects_in(root);
        for (const fs::path& folder : folders)
            is_there = is_there || has_cameras_of(folder, desc.split);
        if (!is_there)
            return no_split(desc, error(Code::kNotFound,
                                        "'%s' holds neither transforms.json nor transforms_%s.json "
                                        "nor a COLMAP model",
                                        root.c_str(), desc.split.c_str()));
        if (!index_.has_splits) find_splits(folders, desc.split);
        for (const fs::path& folder : folders) {
            if (desc.limit != 0 && objects_.size() == desc.limit) break;
            SPLAT_TRY(add(folder, name_of(folder), desc));
        }
        return index_.find_resolution(*this, desc.lenient);
    }

    [[nodiscard]] const DatasetIndex& index() const override { return index_; }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        std::vector<StoredView> views;
        for (const FolderPhoto& photo : objects_[object]) views.push_back(photo.view);
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const FolderPhoto& photo = objects_[object][view];
        fs::path path = photo.path;
        if (kind != MapKind::kRgb) {
            SPLAT_ASSIGN(path, map_file(photo.folder, kind, path.stem().string()));
        }
        SPLAT_ASSIGN(io::Image whole, load_bytes(path, {.header_only = true}));
        if (whole.width != photo.width || whole.height != photo.height)
            return error(Code::kFormat, "'%s': %u x %u pixels, its camera has %u x %u",
                         path.c_str(), whole.width, whole.height, photo.width, photo.height);
        io::Image square{photo.side, photo.side, whole.channels, 8, {}};
        if (header_only) return square;
        SPLAT_ASSIGN(whole, load_bytes(path, {}));
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
    void find_splits(const std::vector<fs::path>& folders, const std::string& split) {
        const std::string name = "transforms_" + split + ".json";
        const auto has = [&name](const fs::path& folder) { return is_file(folder / name); };
        const auto without = std::find_if_not(folders.begin(), folders.end(), has);
        index_.has_splits = without == folders.end();
        if (!index_.has_splits && std::any_of(folders.begin(), folders.end(), has))
            log(LogLevel::kWarning,
                format("'%s' has no %s, which other objects have; the data set counts as one "
                       "without splits",
                       without->c_str(), name.c_str()));
    }

    Status add(const fs::path& folder, const std::string& name, const ReaderDesc& desc) {
        SPLAT_ASSIGN(io::CameraSet set, load_cameras(folder, desc.split));
        std::sort(set.cameras.begin(), set.cameras.end(),
                  [](const auto& a, const auto& b) { return a.name < b.name; });
        FolderPhotos photos;
        ViewNames names;
        std::vector<std::string> problems;
        for (const scene::Camera& camera : set.cameras) {
            auto photo = photograph_of(folder, camera);
            if (!photo.ok() && !desc.lenient) return photo.status();
            if (!photo.ok()) {
                problems.push_back(photo.status().message());
                continue;
            }
            photos.push_back(std::move(photo.value()));
            names.cameras.push_back(camera.name);
            if (lies_outside(photos.back().path, folder))
                index_.files.push_back(photos.back().path);
        }
        names.images = names.cameras;
        SPLAT_TRY(index_.add(name, folder.string(), names, desc.lenient,
                             [&](const std::vector<std::string>&) { objects_.push_back(photos); }));
        index_.problems.back().insert(index_.problems.back().end(), problems.begin(),
                                      problems.end());
        std::vector<std::string> stems;
        for (const FolderPhoto& photo : objects_.back())
            stems.push_back(fs::path(photo.path).stem().string());
        return find_map_files(folder, stems, desc.lenient, index_);
    }

    DatasetIndex index_;
    std::vector<FolderPhotos> objects_;
};

}  // namespace

bool is_image_folder(const std::string& path) {
    if (has_cameras(path) || has_objects(path)) return true;
    for (const char* split : {"train", "val", "test"})
        if (has_objects(fs::path(path) / split)) return true;
    return false;
}

Result<std::unique_ptr<DatasetReader>> open_image_folder(const ReaderDesc& desc) {
    auto reader = std::make_unique<ImageFolderReader>();
    SPLAT_TRY(reader->open(desc));
    return std::unique_ptr<DatasetReader>(std::move(reader));
}

}  // namespace splat::data
