#include "data/srn.h"

#include <algorithm>
#include <filesystem>

#include "data/folder.h"
#include "data/map_files.h"
#include "io/file.h"
#include "io/folder.h"
#include "tables/srn_text.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxTextBytes = 1U << 16;

struct SrnObject {
    fs::path folder;
    std::vector<std::string> views;  ///< stems of the files
};

Result<bool> has_srn_objects(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(folder.string()));
    return io::holds_for_any(names, [&folder](const std::string& name) {
        return io::has_file((folder / name / "intrinsics.txt").string());
    });
}

/// Folders "srn_<category>" of these.
std::vector<std::string> categories_in(const std::vector<std::string>& names) {
    std::vector<std::string> found;
    for (const std::string& name : names)
        if (name.rfind("srn_", 0) == 0) found.push_back(name);
    return found;
}

/// Folders "<category>_<split>" of these, of any split.
std::vector<std::string> splits_in(const std::vector<std::string>& names) {
    std::vector<std::string> found;
    for (const std::string& name : names)
        for (const char* split : {"_train", "_val", "_test"})
            if (name.size() > std::string(split).size() &&
                name.compare(name.size() - std::string(split).size(), std::string::npos, split) ==
                    0)
                found.push_back(name);
    return found;
}

std::string joined(const std::vector<std::string>& words) {
    std::string text;
    for (const std::string& word : words) text += (text.empty() ? "" : ", ") + word;
    return text.empty() ? "none" : text;
}

/// The folder of the objects of a split.
Result<fs::path> split_folder(const ReaderDesc& desc) {
    fs::path folder = desc.path;
    SPLAT_ASSIGN(std::vector<std::string> names, candidates_in(folder));
    SPLAT_ASSIGN(const bool is_split, has_srn_objects(folder));
    if (is_split) return folder;
    const std::vector<std::string> categories = categories_in(names);
    const std::string wanted = "srn_" + desc.category.substr(0, desc.category.find("_priors"));
    const bool chosen = std::find(categories.begin(), categories.end(), wanted) != categories.end();
    if (categories.size() > 1 && !chosen)
        return error(Code::kInvalidArgument, "'%s' holds %s; give the path of one of them",
                     folder.c_str(), joined(categories).c_str());
    if (!categories.empty()) {
        folder /= chosen ? wanted : categories.front();
        SPLAT_ASSIGN(names, candidates_in(folder));
    }
    const std::vector<std::string> splits = splits_in(names);
    std::vector<std::string> found;
    for (const std::string& name : splits)
        if (name.substr(name.rfind('_') + 1) == desc.split) found.push_back(name);
    if (found.empty())
        return no_split(
            desc, error(Code::kNotFound, "'%s' has no folder <category>_%s; folders of splits: %s",
                        folder.c_str(), desc.split.c_str(), joined(splits).c_str()));
    if (found.size() > 1)
        return error(Code::kInvalidArgument, "'%s' holds %s; give the path of one of them",
                     folder.c_str(), joined(found).c_str());
    folder /= found.front();
    SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(folder.string()));
    SPLAT_TRY(check_link(kind, folder));
    SPLAT_ASSIGN(const bool has_some, has_srn_objects(folder));
    if (has_some) return folder;
    SPLAT_ASSIGN(names, io::folders_in(folder.string()));
    for (const std::string& name : names) {  // for example srn_chairs/chairs_train/chairs_2.0_train
        SPLAT_ASSIGN(const bool is_below, has_srn_objects(folder / name));
        if (is_below) return folder / name;
    }
    return error(Code::kFormat, "'%s' holds no folder with intrinsics.txt", folder.c_str());
}

Result<std::string> text_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(path.string(), kMaxTextBytes));
    return std::string(io::as_text(file));
}

Result<tables::Focal> focal_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const std::string text, text_of_file(path));
    auto focal = tables::focal_of(text);
    if (!focal.ok()) return in_file(focal.status(), path.string());
    return focal;
}

Result<scene::Mat4> pose_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const std::string text, text_of_file(path));
    const auto pose = tables::pose_of(text);
    if (!pose.ok()) return in_file(pose.status(), path.string());
    SPLAT_TRY(check_pose(pose.value(), path.string()));
    return pose;
}

class SrnReader : public DatasetReader {
  public:
    Status open(const ReaderDesc& desc) {
        index_.format = "srn";
        index_.split = desc.split;
        index_.ignores_alpha = true;
        index_.maps = kAllMaps;
        SPLAT_ASSIGN(const fs::path root, split_folder(desc));
        index_.has_splits = root != desc.path;
        SPLAT_ASSIGN(const std::vector<std::string> names, candidates_in(root));
        for (const std::string& name : names) {
            if (desc.limit != 0 && objects_.size() == desc.limit) break;
            SPLAT_TRY(index_.take(desc, name, (root / name).string(),
                                  [&] { return add(root / name, name, desc.lenient); }));
            objects_.resize(index_.names.size());
        }
        return index_.find_resolution(*this, desc.lenient);
    }

    [[nodiscard]] const DatasetIndex& index() const override { return index_; }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        const SrnObject& found = objects_[object];
        SPLAT_ASSIGN(const tables::Focal focal, focal_of_file(found.folder / "intrinsics.txt"));
        std::vector<StoredView> views;
        for (const std::string& name : found.views) {
            SPLAT_ASSIGN(const scene::Mat4 pose,
                         pose_of_file(found.folder / "pose" / (name + ".txt")));
            views.push_back({pose, focal.x, focal.y, 0});
        }
        return views;
    }

    [[nodiscard]] Result<io::Image> image(std::uint32_t object, std::uint32_t view, MapKind kind,
                                          bool header_only) const override {
        const SrnObject& found = objects_[object];
        const std::string& stem = found.views[view];
        if (kind == MapKind::kRgb)
            return load_square(found.folder / "rgb" / (stem + ".png"), header_only);
        SPLAT_ASSIGN(const fs::path path, map_file(found.folder, kind, stem));
        return load_map(path, kind, {.square = true, .header_only = header_only});
    }

    [[nodiscard]] Result<ObjectText> text(std::uint32_t object) const override {
        const SrnObject& found = objects_[object];
        ObjectText text;
        SPLAT_ASSIGN(text.intrinsics, text_of_file(found.folder / "intrinsics.txt"));
        for (const std::string& name : found.views) {
            SPLAT_ASSIGN(std::string pose, text_of_file(found.folder / "pose" / (name + ".txt")));
            text.views.push_back({name, std::move(pose)});
        }
        return text;
    }

  private:
    Result<bool> add(const fs::path& folder, const std::string& name, bool lenient) {
        SPLAT_ASSIGN(const std::vector<io::FolderEntry> parts, io::entries_in(folder.string()));
        const auto has = [&parts](const char* part) {
            return std::any_of(parts.begin(), parts.end(),
                               [part](const io::FolderEntry& each) { return each.name == part; });
        };
        if (!has("rgb") && !has("pose") && !has("intrinsics.txt")) return false;
        if (!has("intrinsics.txt"))
            return error(Code::kFormat, "'%s' has no intrinsics.txt", folder.c_str());
        ViewNames names;
        SPLAT_ASSIGN(names.cameras, stems_in(folder / "pose", ".txt"));
        SPLAT_ASSIGN(names.images, stems_in(folder / "rgb", ".png"));
        SPLAT_TRY(
            index_.add(name, folder.string(), names, lenient, [&](std::vector<std::string> views) {
                objects_.push_back({folder, std::move(views)});
            }));
        SPLAT_TRY(find_map_files(folder, objects_.back().views, lenient, index_));
        return true;
    }

    DatasetIndex index_;
    std::vector<SrnObject> objects_;
};

}  // namespace

Result<bool> is_srn(const std::string& path) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(path));
    if (!categories_in(names).empty() || !splits_in(names).empty()) return true;
    return has_srn_objects(path);
}

Result<std::unique_ptr<DatasetReader>> open_srn(const ReaderDesc& desc) {
    auto reader = std::make_unique<SrnReader>();
    SPLAT_TRY(reader->open(desc));
    return std::unique_ptr<DatasetReader>(std::move(reader));
}

}  // namespace splat::data
