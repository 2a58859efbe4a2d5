#include "data/formats.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
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

Result<bool> has_renders(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> names, stems_in(folder, ".npy"));
    if (names.empty()) return false;
    return io::has_file(os::text_of(folder / (names.front() + ".png")));
}

Result<bool> any_has_renders(const fs::path& path, const char* below) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(os::text_of(path)));
    return io::holds_for_any(
        names, [&](const std::string& name) { return has_renders(path / name / below); });
}

/// The objects of Objaverse, or of GSO, whose renders lie `below` the folder of each.
class RenderReader : public FilesReader {
  public:
    RenderReader(const ReaderDesc& desc, const char* format, const char* below, bool split)
        : FilesReader(format, desc, Filter::kLanczos), below_(os::path_of(below)), split_(split) {
        index_.source_distance = kSourceDistance;
    }

    Status open() {
        std::vector<std::string> names;
        if (desc_.objects_file.empty()) {
            SPLAT_ASSIGN(names, candidates_in(os::path_of(desc_.path)));
        } else {
            SPLAT_SET(names, load_object_list(desc_.objects_file));
        }
        if (split_) {
            const auto train = static_cast<std::ptrdiff_t>(names.size() * 99 / 100);
            if (desc_.split == "train")
                names.erase(names.begin() + train, names.end());
            else
                names.erase(names.begin(), names.begin() + train);
        }
        for (const std::string& name : names) {
            if (is_full()) break;
            const fs::path object = os::path_of(desc_.path) / name;
            const fs::path folder = below_.empty() ? object : object / below_;
            SPLAT_TRY(take(name, folder, [&]() -> Result<bool> {
                SPLAT_ASSIGN(const auto parts, io::entries_in(os::text_of(object)));
                const bool is_begun = std::ranges::any_of(parts, [&](const auto& part) {
                    return !below_.empty() && part.name == os::text_of(*below_.begin());
                });
                return add_object(folder, name, !desc_.objects_file.empty() || is_begun);
            }));
        }
        SPLAT_TRY(index_.check_any());
        if (objects_.empty())
            return no_split(desc_, not_found("'%s' holds no objects for the split '%s'",
                                             desc_.path.c_str(), desc_.split.c_str()));
        return index_.find_resolution(*this, desc_.lenient);
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        std::vector<StoredView> views;
        for (const std::string& name : objects_[object].stems) {
            const std::string path = os::text_of(objects_[object].folder / (name + ".npy"));
            SPLAT_ASSIGN(const io::Buffer file, io::read_file(path, kMaxPoseBytes));
            SPLAT_ASSIGN(const auto matrix, in_file(io::read_npy(file), path));
            SPLAT_ASSIGN(const auto pose, in_file(pose_of_objaverse(matrix.values), path));
            views.push_back({pose, kObjaverseFocal, kObjaverseFocal, 0});
        }
        return views;
    }

  private:
    /// False for a folder without renders, unless it must have some.
    Result<bool> add_object(const fs::path& folder, const std::string& name, bool must) {
        ViewNames names;
        SPLAT_ASSIGN(names.cameras, stems_in(folder, ".npy"));
        SPLAT_ASSIGN(names.images, stems_in(folder, ".png"));
        if (names.cameras.empty() && names.images.empty() && !must) return false;
        return add(folder, name, names, "", ".png");
    }

    fs::path below_;
    bool split_;
};

}  // namespace

Result<bool> is_objaverse(const std::string& path) {
    return any_has_renders(os::path_of(path), "");
}

Result<bool> is_gso(const std::string& path) {
    return any_has_renders(os::path_of(path), kGsoFolder);
}

Result<std::unique_ptr<DatasetReader>> open_objaverse(const ReaderDesc& desc) {
    if (desc.split == "test")
        return no_split(desc,
                        not_found("'%s': Objaverse has no split 'test'; evaluate on its 'val', "
                                  "or on the scenes of GSO as the published code does",
                                  desc.path.c_str()));
    return opened<RenderReader>(desc, "objaverse", "", true);
}

Result<std::unique_ptr<DatasetReader>> open_gso(const ReaderDesc& desc) {
    if (desc.split == "train")
        return no_split(desc,
                        not_found("'%s': GSO has no split 'train', because it is for evaluation "
                                  "only; train on Objaverse",
                                  desc.path.c_str()));
    return opened<RenderReader>(desc, "gso", kGsoFolder, false);
}

Result<scene::Mat4> pose_of_objaverse(std::span<const float> world_to_camera) {
    if (world_to_camera.size() != 12)
        return damaged("a pose of %zu numbers, expected 3 x 4", world_to_camera.size());
    scene::Mat4 matrix{};
    for (std::size_t i = 0; i < 12; ++i)
        matrix[i] = static_cast<double>(world_to_camera[i]) * (i / 4 == 0 ? 1 : -1);
    matrix[15] = 1;
    return inverse_pose(matrix);
}

}  // namespace splat::data
