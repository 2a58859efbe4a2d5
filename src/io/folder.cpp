#include "io/folder.h"

#include <algorithm>
#include <atomic>
#include <cerrno>

#include "core/fault.h"
#include "core/no_copy.h"
#include "core/os/file.h"
#include "core/os/process.h"
#include "core/shown.h"
#include "io/file.h"

namespace splat::io {
namespace {

namespace fs = std::filesystem;

/// Removes a folder now and in the end, also where an exception ends the work.
class RemovedFolder : NoCopy {
  public:
    explicit RemovedFolder(const fs::path& path) : path_(path) { remove(); }
    ~RemovedFolder() { remove(); }

  private:
    void remove() const {
        std::error_code ignored;
        fs::remove_all(path_, ignored);
    }
    const fs::path& path_;
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
    fs::path so_far = folder;
    for (const fs::path& part : fs::path(path)) {
        so_far /= part;
        if (os::is_link(so_far.string()))
            return damaged(
                "%s: '%s' is a symbolic link, which may lead out of the folder; put a copy there",
                what.c_str(), shown(so_far.string()).c_str());
    }
    return {};
}

Status make_folders(const fs::path& path) {
    std::error_code failed;
    fs::create_directories(path, failed);
    return failed ? system_error(failed, "create the folder", path.string()) : Status();
}

Status write_folder(const fs::path& folder, const fs::path& temporary,
                    const std::function<Status(const fs::path&)>& write) {
    const RemovedFolder removed(temporary);
    SPLAT_TRY(write(temporary));
    std::error_code failed;
    fs::rename(temporary, folder, failed);
    return failed ? system_error(failed, "create the folder", folder.string()) : Status();
}

fs::path temporary_of(const fs::path& folder) {
    static std::atomic<unsigned> counter{0};
    return folder.parent_path() / format(".%s.%lld-%u.tmp", folder.filename().string().c_str(),
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
