#include "core/shown.h"
#include "data/formats.h"

#include <algorithm>
#include <filesystem>

#include "core/os/path.h"
#include "data/folder.h"
#include "data/map_files.h"
#include "io/file.h"
#include "io/folder.h"
#include "tables/srn_text.h"

namespace splat::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kMaxTextBytes = 1U << 16;

Result<bool> has_srn_objects(const fs::path& folder) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(os::text_of(folder)));
    return io::holds_for_any(names, [&folder](const std::string& name) {
        return io::has_file(os::text_of(folder / name / "intrinsics.txt"));
    });
}

/// Folders "srn_<category>" of these.
std::vector<std::string> categories_in(std::vector<std::string> names) {
    std::erase_if(names, [](const std::string& name) { return !name.starts_with("srn_"); });
    return names;
}

/// Folders "<category>_<split>" of these, of any split.
std::vector<std::string> splits_in(std::vector<std::string> names) {
    std::erase_if(names, [](const std::string& name) {
        const auto of = [&name](const std::string& end) {
            return name.size() > end.size() && name.ends_with(end);
        };
        return !of("_train") && !of("_val") && !of("_test");
    });
    return names;
}

std::string list_of(const std::vector<std::string>& words) {
    return words.empty() ? "none" : joined(words);
}

/// The folder of the objects of a split.
Result<fs::path> split_folder(const ReaderDesc& desc) {
    fs::path folder = os::path_of(desc.path);
    SPLAT_ASSIGN(std::vector<std::string> names, candidates_in(folder));
    SPLAT_ASSIGN(const bool is_split, has_srn_objects(folder));
    if (is_split) return folder;
    const std::vector<std::string> categories = categories_in(names);
    const std::string wanted = "srn_" + desc.category.substr(0, desc.category.find("_priors"));
    const bool chosen = std::ranges::find(categories, wanted) != categories.end();
    if (categories.size() > 1 && !chosen)
        return invalid("'%s' holds %s; give the path of one of them", os::text_of(folder).c_str(),
                       list_of(categories).c_str());
    if (!categories.empty()) {
        folder = folder / (chosen ? wanted : categories.front());
        SPLAT_ASSIGN(names, candidates_in(folder));
    }
    const std::vector<std::string> splits = splits_in(names);
    std::vector<std::string> found;
    for (const std::string& name : splits)
        if (name.substr(name.rfind('_') + 1) == desc.split) found.push_back(name);
    if (found.empty())
        return no_split(desc, not_found("'%s' has no folder <category>_%s; folders of splits: %s",
                                        os::text_of(folder).c_str(), desc.split.c_str(),
                                        list_of(splits).c_str()));
    if (found.size() > 1)
        return invalid("'%s' holds %s; give the path of one of them", os::text_of(folder).c_str(),
                       list_of(found).c_str());
    folder = folder / found.front();
    SPLAT_ASSIGN(const io::PathKind kind, io::kind_of(os::text_of(folder)));
    SPLAT_TRY(check_link(kind, folder));
    SPLAT_ASSIGN(const bool has_some, has_srn_objects(folder));
    if (has_some) return folder;
    SPLAT_ASSIGN(names, io::folders_in(os::text_of(folder)));
    for (const std::string& name : names) {  // for example srn_chairs/chairs_train/chairs_2.0_train
        SPLAT_ASSIGN(const bool is_below, has_srn_objects(folder / name));
        if (is_below) return folder / name;
    }
    return damaged("'%s' holds no folder with intrinsics.txt", os::text_of(folder).c_str());
}

Result<std::string> text_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const io::Buffer file, io::read_file(os::text_of(path), kMaxTextBytes));
    return std::string(io::as_text(file));
}

Result<tables::Focal> focal_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const std::string text, text_of_file(path));
    return in_file(tables::focal_of(text), os::text_of(path));
}

Result<scene::Mat4> pose_of_file(const fs::path& path) {
    SPLAT_ASSIGN(const std::string text, text_of_file(path));
    return pose_of_text(text, os::text_of(path));
}

class SrnReader : public FilesReader {
  public:
    explicit SrnReader(const ReaderDesc& desc) : FilesReader("srn", desc, Filter::kBicubic) {
        index_.ignores_alpha = true;
    }

    Status open() {
        SPLAT_ASSIGN(const fs::path root, split_folder(desc_));
        index_.has_splits = root != os::path_of(desc_.path);
        SPLAT_ASSIGN(const std::vector<std::string> names, candidates_in(root));
        for (const std::string& name : names) {
            if (is_full()) break;
            SPLAT_TRY(take(name, root / name, [&] { return add_object(root / name, name); }));
        }
        return index_.find_resolution(*this, desc_.lenient);
    }

    [[nodiscard]] Result<std::vector<StoredView>> cameras(std::uint32_t object) const override {
        const FilesObject& found = objects_[object];
        SPLAT_ASSIGN(const tables::Focal focal, focal_of_file(found.folder / "intrinsics.txt"));
        std::vector<StoredView> views;
        for (const std::string& name : found.stems) {
            SPLAT_ASSIGN(const scene::Mat4 pose,
                         pose_of_file(found.folder / "pose" / (name + ".txt")));
            views.push_back({pose, focal.x, focal.y, 0});
        }
        return views;
    }

    [[nodiscard]] Result<ObjectText> text(std::uint32_t object) const override {
        const FilesObject& found = objects_[object];
        ObjectText text;
        SPLAT_ASSIGN(text.intrinsics, text_of_file(found.folder / "intrinsics.txt"));
        for (const std::string& name : found.stems) {
            SPLAT_ASSIGN(std::string pose, text_of_file(found.folder / "pose" / (name + ".txt")));
            text.views.push_back({name, std::move(pose)});
        }
        return text;
    }

  private:
    Result<bool> add_object(const fs::path& folder, const std::string& name) {
        SPLAT_ASSIGN(const std::vector<io::FolderEntry> parts, io::entries_in(os::text_of(folder)));
        const auto has = [&parts](const char* part) {
            return std::ranges::any_of(
                parts, [part](const io::FolderEntry& each) { return each.name == part; });
        };
        if (!has("rgb") && !has("pose") && !has("intrinsics.txt")) return false;
        if (!has("intrinsics.txt"))
            return damaged("'%s' has no intrinsics.txt", os::text_of(folder).c_str());
        ViewNames names;
        SPLAT_ASSIGN(names.cameras, stems_in(folder / "pose", ".txt"));
        SPLAT_ASSIGN(names.images, stems_in(folder / "rgb", ".png"));
        return add(folder, name, names, "rgb/", ".png");
    }
};

}  // namespace

Result<scene::Mat4> pose_of_text(std::string_view text, const std::string& place) {
    SPLAT_ASSIGN(const scene::Mat4 pose, in_file(tables::pose_of(text), place));
    SPLAT_TRY(check_pose(pose, place));
    return pose;
}

Result<bool> is_srn(const std::string& path) {
    SPLAT_ASSIGN(const std::vector<std::string> names, io::folders_in(path));
    if (!categories_in(names).empty() || !splits_in(names).empty()) return true;
    return has_srn_objects(os::path_of(path));
}

Result<std::unique_ptr<DatasetReader>> open_srn(const ReaderDesc& desc) {
    return opened<SrnReader>(desc);
}

}  // namespace splat::data
