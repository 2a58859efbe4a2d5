#include "data/objaverse.h"

#include <algorithm>
#include <filesystem>

#include "data/folder.h"
#include "data/map_files.h"
#include "data/object_lists.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/npy.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr double kObjaverseFocal = 140.0 / 128;  ///< in widths
constexpr double kSourceDistance = 2;  ///< distance of each read's first camera from the origin
constexpr std::uint64_t kMaxPoseBytes = 1U << 16;
constexpr const char* kGsoFolder = "render_mvs_25/model";

struct RenderedObject {
    fs::path folder;
    std::vector<std::string> views;
};

Result<bool> has_renders(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> names, stems_in(folder, ".npy"));
    if (names.empty()) return false;
    return io::has_file((folder / (names.front() + ".png")).string());
}

Result<bool> any_has_renders(const fs::path& path, const char* below) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(path.string()));
    return io::holds_for_any(
        names, [&](const std::string& name) { return has_renders(path / name / below); });
}

class RenderReader : public DatasetReader {
  public:
    Status open(const ReaderDesc& desc, const char* format, const char* below, bool split) {
        index_.format = format;
        index_.split = desc.split;
        index_.filter = Filter::kLanczos;
        index_.source_distance = kSourceDistance;
        index_.maps = kAllMaps;
        std::vector<std::string> names;
        if (desc.objects_file.empty()) {
            SPLAT_ASSIGN(names, candidates_in(desc.path));
        } else {
            SPLAT_ASSIGN(names, load_object_list(desc.objects_file));
        }
        if (split) {
            const auto train = static_cast<std::ptrdiff_t>(names.size() * 99 / 100);
            if (desc.split == "train")
                names.erase(names.begin() + train, names.end());
            else
                names.erase(names.begin(), names.begin() + train);
        }
        for (const std::string& name : names) {
            if (desc.limit != 0 && objects_.size() == desc.limit) break;
            const fs::path object = fs::path(desc.path) / name;
            const fs::path folder = *below == '\0' ? object : object / below;
            SPLAT_TRY(index_.take(desc, name, folder.string(), [&]() -> Result<bool> {
                SPLAT_ASSIGN(const auto parts, io::entries_in(object.string()));
                const bool is_begun =
                    std::any_of(parts.begin(), parts.end(), [&](const auto& part) {
                        return *below != '\0' && part.name == fs::path(below).begin()->string();
                    });
                return add(folder, name, !desc.objects_file.empty() || is_begun, desc.lenient);
            }));
            objects_.resize(index_.names.size());
        }
        SPLAT_TRY(index_.check_any());
        if (objects_.empty())
            return no_split(desc, error(Code::kNotFound, "'%s' holds no objects for the split '%s'",
                                        desc.path.c_str(), desc.split.c_str()));
        return index_.find_resolution(*this, desc.lenient);
    }

    [[nodiscard]] const DatasetIndex& index() const override { return index_; }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        std::vector<StoredView> views;
        for (const std::string& name : objects_[object].views) {
            const std::string path = (objects_[object].folder / (name + ".npy")).string();
            SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxPoseBytes));
            const auto matrix = io::read_npy(file);
            if (!matrix.ok()) return in_file(matrix.status(), path);
            const auto pose = pose_of_objaverse(matrix.value().values);
            if (!pose.ok()) return in_file(pose.status(), path);
            views.push_back({pose.value(), kObjaverseFocal, kObjaverseFocal, 0});
        }
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const RenderedObject& found = objects_[object];
        const std::string& stem = found.views[view];
        if (kind == MapKind::kRgb) return load_square(found.folder / (stem + ".png"), header_only);
        SPLAT_ASSIGN(const fs::path path, map_file(found.folder, kind, stem));
        return load_map(path, kind, {.square = true, .header_only = header_only});
    }

  private:
    /// False for a folder without renders, unless it must have some.
    Result<bool> add(const fs::path& folder, const std::string& name, bool must, bool lenient) {
        ViewNames names;
        SPLAT_ASSIGN(names.cameras, stems_in(folder, ".npy"));
        SPLAT_ASSIGN(names.images, stems_in(folder, ".png"));
        if (names.cameras.empty() && names.images.empty() && !must) return false;
        SPLAT_TRY(
            index_.add(name, folder.string(), names, lenient, [&](std::vector<std::string> views) {
                objects_.push_back({folder, std::move(views)});
            }));
        SPLAT_TRY(find_map_files(folder, objects_.back().views, lenient, index_));
        return true;
    }

    DatasetIndex index_;
    std::vector<RenderedObject> objects_;
};

Result<std::unique_ptr<DatasetReader>> opened(const ReaderDesc& desc, const char* format,
                                              const char* below, bool split) {
    auto reader = std::make_unique<RenderReader>();
    SPLAT_TRY(reader->open(desc, format, below, split));
    return std::unique_ptr<DatasetReader>(std::move(reader));
}

}  // namespace

Result<bool> is_objaverse(const std::string& path) {
    return any_has_renders(path, "");
}

Result<bool> is_gso(const std::string& path) {
    return any_has_renders(path, kGsoFolder);
}

Result<std::unique_ptr<DatasetReader>> open_objaverse(const ReaderDesc& desc) {
    if (desc.split == "test")
        return no_split(desc, error(Code::kNotFound,
                                    "'%s': Objaverse has no split 'test'; evaluate on its 'val', "
                                    "or on the scenes of GSO as the published code does",
                                    desc.path.c_str()));
    return opened(desc, "objaverse", "", true);
}

Result<std::unique_ptr<DatasetReader>> open_gso(const ReaderDesc& desc) {
    if (desc.split == "train")
        return no_split(desc, error(Code::kNotFound,
                                    "'%s': GSO has no split 'train', because it is for evaluation "
                                    "only; train on Objaverse",
                                    desc.path.c_str()));
    return opened(desc, "gso", kGsoFolder, false);
}

Result<scene::Mat4> pose_of_objaverse(std::span<const float> world_to_camera) {
    if (world_to_camera.size() != 12)
        return error(Code::kFormat, "a pose of %zu numbers, expected 3 x 4",
                     world_to_camera.size());
    scene::Mat4 matrix{};
    for (std::size_t i = 0; i < 12; ++i)
        matrix[i] = static_cast<double>(world_to_camera[i]) * (i / 4 == 0 ? 1 : -1);
    matrix[15] = 1;
    return inverse_pose(matrix);
}

}  // namespace splat::data
