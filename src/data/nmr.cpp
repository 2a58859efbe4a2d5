#include "data/formats.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/os/path.h"
#include "core/shown.h"
#include "data/folder.h"
#include "data/map_files.h"
#include "data/object_lists.h"
#include "io/file.h"
#include "io/folder.h"
#include "io/weights_formats.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxListBytes = 1U << 26;
/// camera_mat[0][0] of all of NMR's images, in half widths.
constexpr double kNmrFocal = 3.7320509;

fs::path list_path(const fs::path& category, const std::string& split) {
    return category / ("softras_" + split + ".lst");
}

Result<scene::Mat4> pose_at(const io::WeightsFile& file, std::size_t view) {
    const io::NamedTensor* matrix = file.tensors.find("world_mat_inv_" + std::to_string(view));
    if (matrix != nullptr) return pose_of_nmr(matrix->values);
    matrix = file.tensors.find("world_mat_" + std::to_string(view));
    if (matrix == nullptr)
        return damaged("there is neither world_mat_inv_%zu nor world_mat_%zu", view, view);
    SPLAT_ASSIGN(const scene::Mat4 world_to_camera, affine(matrix->values));
    SPLAT_ASSIGN(const scene::Mat4 inverse, inverse_pose(world_to_camera));
    std::vector<float> values(inverse.begin(), inverse.end());
    return pose_of_nmr(values);
}

Status check_focal(const io::WeightsFile& file, std::size_t view) {
    const io::NamedTensor* lens = file.tensors.find("camera_mat_" + std::to_string(view));
    if (lens == nullptr || lens->values.empty()) return {};
    const std::size_t columns = lens->values.size() == 16 ? 4 : 3;  // the matrix is [4,4] or [3,3]
    auto focal = static_cast<double>(lens->values[0]);
    if (std::abs(focal - kNmrFocal) < 1e-5 && lens->values.size() > columns + 1)
        focal = static_cast<double>(lens->values[columns + 1]);
    if (std::abs(focal - kNmrFocal) < 1e-5) return {};
    return damaged("camera_mat_%zu has the focal length %g, expected %g", view, focal, kNmrFocal);
}

class NmrReader : public FilesReader {
  public:
    explicit NmrReader(const ReaderDesc& desc) : FilesReader("nmr", desc, Filter::kBicubic) {}

    Status open() {
        if (desc_.split == "test" && !desc_.views_file.empty()) {
            SPLAT_TRY(add_source_views());
            return index_.find_resolution(*this, desc_.lenient);
        }
        SPLAT_TRY(add_categories());
        SPLAT_TRY(index_.check_any());
        if (objects_.empty())
            return no_split(desc_, not_found("'%s' has no objects in <category>/softras_%s.lst",
                                             desc_.path.c_str(), desc_.split.c_str()));
        return index_.find_resolution(*this, desc_.lenient);
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        const std::string path = os::text_of(objects_[object].folder / "cameras.npz");
        SPLAT_ASSIGN(const auto source, io::open_source(path));
        SPLAT_ASSIGN(const auto file, in_file(io::read_npz(*source), path));
        std::vector<StoredView> views;
        for (std::size_t i = 0; i < objects_[object].stems.size(); ++i) {
            SPLAT_ASSIGN(const auto pose, in_file(pose_at(file, i), path));
            SPLAT_TRY(in_file(check_focal(file, i), path));
            views.push_back({pose, kNmrFocal / 2, kNmrFocal / 2, 0});
        }
        return views;
    }

  private:
    /// The lists of a split, of all categories.
    Status add_categories() {
        SPLAT_ASSIGN(const std::vector<std::string> names, candidates_in(os::path_of(desc_.path)));
        std::vector<std::string> without;  // a list of this split, but not of others
        for (const std::string& category : names) {
            const fs::path folder = os::path_of(desc_.path) / category;
            std::vector<std::string> lists;
            const auto has = [&lists](const std::string& split) {
                return std::ranges::find(lists, "softras_" + split) != lists.end();
            };
            const auto find_lists = [&]() -> Result<bool> {
                SPLAT_TRY(io::entries_in(os::text_of(folder)).status());
                SPLAT_ASSIGN(lists, stems_in(folder, ".lst"));
                return has("train") || has("val") || has("test");
            };
            SPLAT_TRY(take(category, folder, find_lists));
            if (has(desc_.split))
                SPLAT_TRY(add_list(category, list_path(folder, desc_.split)));
            else if (!lists.empty())
                without.push_back(category);
        }
        for (const std::string& category :
             objects_.empty() ? std::vector<std::string>() : without) {
            const fs::path list = list_path(os::path_of(desc_.path) / category, desc_.split);
            SPLAT_TRY(take(category, list.parent_path(), [&list] {
                return damaged("there is no '%s', which other categories have",
                               os::text_of(list).c_str());
            }));
        }
        return {};
    }

    Status add_list(const std::string& category, const fs::path& list) {
        const auto file = io::read_file(os::text_of(list), kMaxListBytes);
        SPLAT_TRY(as_damage(file.status()));
        const std::string_view text = io::as_text(file.value());
        if (text.find_first_not_of("\r\n") == std::string_view::npos)
            return damaged("'%s' names no object", os::text_of(list).c_str());
        for (std::size_t at = 0; at < text.size();) {
            const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
            const std::string name(text.substr(at, end - at));
            at = end + 1;
            if (name.empty() || is_full()) continue;
            if (!is_folder_name(name))
                return damaged("'%s': '%s' is not the name of a folder", os::text_of(list).c_str(),
                               shown(name).c_str());
            SPLAT_TRY(take_object(category, name));
        }
        return {};
    }

    /// The test objects of PixelNeRF's list, in its order.
    Status add_source_views() {
        SPLAT_ASSIGN(const std::vector<SourceView> sources, load_source_views(desc_.views_file));
        for (const SourceView& source : sources) {
            if (is_full()) break;
            SPLAT_TRY(take_object(source.category, source.object));
            if (objects_.size() == index_.source_views.size()) continue;  // is left out
            const std::size_t views = objects_.back().stems.size();
            if (source.view >= views && !desc_.lenient)
                return damaged("'%s': view %u of %s, which has %zu views", desc_.views_file.c_str(),
                               source.view, index_.names.back().c_str(), views);
            index_.source_views.push_back(source.view);
        }
        return {};
    }

    Status take_object(const std::string& category, const std::string& object) {
        const fs::path folder = os::path_of(desc_.path) / category / object;
        const std::string name = category + "_" + object;
        return take(name, folder, [&] { return add_object(folder, name); });
    }

    Result<bool> add_object(const fs::path& folder, const std::string& name) {
        SPLAT_ASSIGN(const bool has_cameras, io::has_file(os::text_of(folder / "cameras.npz")));
        if (!has_cameras) return damaged("'%s' has no cameras.npz", os::text_of(folder).c_str());
        SPLAT_ASSIGN(const std::vector<std::string> images, images_in(folder / "image"));
        return add(folder, name, {images, images}, "image/", "");
    }
};

}  // namespace

Result<bool> is_nmr(const std::string& path) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(path));
    return io::holds_for_any(names, [&path](const std::string& category) {
        return io::holds_for_any({"train", "val", "test"}, [&](const std::string& split) {
            return io::has_file(os::text_of(list_path(os::path_of(path) / category, split)));
        });
    });
}

Result<std::unique_ptr<DatasetReader>> open_nmr(const ReaderDesc& desc) {
    return opened<NmrReader>(desc);
}

Result<scene::Mat4> pose_of_nmr(std::span<const float> world_mat_inv) {
    SPLAT_ASSIGN(const scene::Mat4 pose, affine(world_mat_inv));
    scene::Mat4 turned = pose;  // x, y, z become x, -z, y
    for (std::size_t i = 0; i < 4; ++i) {
        turned[4 + i] = -pose[8 + i];
        turned[8 + i] = pose[4 + i];
    }
    SPLAT_TRY(check_pose(turned, "world_mat_inv"));
    return turned;
}

}  // namespace splat::data
