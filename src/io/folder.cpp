#include "io/folder.h"

#include <algorithm>
#include <atomic>
#include <cerrno>

#include "core/fault.h"
#include "core/no_copy.h"
#include "core/os/file.h"
#include "core/os/path.h"
#include "core/os/process.h"
#include "core/shown.h"
#include "io/file.h"

namespace splat::io {
namespace {

namespace fs = std::filesystem;

/// Removes what can be removed of a file or folder. Takes long paths on Windows, too.
void remove_all(const std::string& path) {
    std::vector<os::Listed> all;
    if (!os::is_link(path) && os::list(path, all) == 0)
        for (const os::Listed& entry : all)
            if (entry.name != "." && entry.name != "..") remove_all(path + "/" + entry.name);
    os::remove(path);
}

/// Removes a folder now and in the end, also where an exception ends the work.
class RemovedFolder : NoCopy {
  public:
    explicit RemovedFolder(std::string path) : path_(std::move(path)) { remove_all(path_); }
    ~RemovedFolder() { remove_all(path_); }

  private:
    std::string path_;
};

PathKind kind_in(os::FileKind kind) {
    if (kind == os::FileKind::kFile) return PathKind::kFile;
    return kind == os::FileKind::kFolder ? PathKind::kFolder : PathKind::kOther;
}

Status cannot_list(int number, const std::string& folder) {
    const auto kind = kind_of(folder);
    if (kind.ok() && kind.value() == PathKind::kBrokenLink)
        return not_found("'%s' is a link to what does not exist", shown(folder).c_str());
    return system_error(number, "list the folder", folder);
}

Result<std::vector<os::Listed>> list(const std::string& folder) {
    std::vector<os::Listed> all;
    if ((SPLAT_FAULT("io.list") ? (errno = EACCES, -1) : os::list(folder, all)) != 0)
        return cannot_list(errno, folder);
    std::erase_if(all, [](const os::Listed& entry) { return entry.name[0] == '.'; });
    std::ranges::sort(all, {}, &os::Listed::name);
    return all;
}

}  // namespace

Status check_no_links(const std::string& folder, const std::string& path, const std::string& what) {
    fs::path so_far = os::path_of(folder);
    for (const fs::path& part : os::path_of(path)) {
        so_far /= part;
        if (os::is_link(os::text_of(so_far)))
            return damaged(
                "%s: '%s' is a symbolic link, which may lead out of the folder; put a copy there",
                what.c_str(), shown(os::text_of(so_far)).c_str());
    }
    return {};
}

Status make_folders(const fs::path& path) {
    const std::string folder = os::text_of(path);
    if (os::make_folders(folder) == 0) return {};
    return system_error(errno, "create the folder", folder);
}

Status write_folder(const fs::path& folder, const fs::path& temporary,
                    const std::function<Status(const fs::path&)>& write) {
    const RemovedFolder removed(os::text_of(temporary));
    SPLAT_TRY(write(temporary));
    const std::string target = os::text_of(folder);
    if (os::rename(os::text_of(temporary), target) == 0) return {};
    return system_error(errno, "create the folder", target);
}

fs::path temporary_of(const fs::path& folder) {
    static std::atomic<unsigned> counter{0};
    return folder.parent_path() / format(".%s.%lld-%u.tmp", os::text_of(folder.filename()).c_str(),
                                         lld(os::process_id()), counter++);
}

Result<PathKind> kind_of(const std::string& path) {
    os::FileInfo info;
    errno = 0;
    if (!SPLAT_FAULT("io.stat") && os::examine(path, info) == 0) return kind_in(info.kind);
    const int number = errno != 0 ? errno : EACCES;
    if (number != ENOENT && number != ENOTDIR && number != ELOOP)
        return system_error(number, "look at", path);
    return os::is_link(path) ? PathKind::kBrokenLink : PathKind::kNothing;
}

Result<bool> has_file(const std::string& path) {
    SPLAT_ASSIGN(const PathKind kind, kind_of(path));
    return kind == PathKind::kFile;
}

Result<std::vector<std::string>> names_in(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<os::Listed> all, list(folder));
    std::vector<std::string> names;
    for (const os::Listed& listed : all) names.push_back(listed.name);
    return names;
}

Result<std::vector<FolderEntry>> entries_in(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<os::Listed> all, list(folder));
    std::vector<FolderEntry> entries;
    for (const os::Listed& listed : all) {
        FolderEntry entry{listed.name, PathKind::kNothing};
        if (listed.kind) {
            entry.kind = kind_in(*listed.kind);
        } else {
            SPLAT_SET(entry.kind, kind_of(folder + "/" + listed.name));
        }
        entries.push_back(std::move(entry));
    }
    return entries;
}

Result<std::vector<std::string>> folders_in(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<FolderEntry> entries, entries_in(folder));
    std::vector<std::string> names;
    for (const FolderEntry& entry : entries)
        if (entry.kind == PathKind::kFolder) names.push_back(entry.name);
    return names;
}

Result<bool> holds_for_any(const std::vector<std::string>& names,
                           const std::function<Result<bool>(const std::string&)>& holds) {
    Status first;
    for (const std::string& name : names) {
        const auto found = holds(name);
        if (found.ok() && found.value()) return true;
        if (!found.ok() && first.ok()) first = found.status();
    }
    if (!first.ok()) return first;
    return false;
}

}  // namespace splat::io
