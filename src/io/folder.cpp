#include "io/folder.h"

#include <dirent.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <memory>

#include "core/fault.h"
#include "core/no_copy.h"
#include "core/shown.h"
#include "io/file.h"

namespace splat::io {
namespace {

namespace fs = std::filesystem;

struct CloseFolder {
    void operator()(DIR* folder) const { ::closedir(folder); }
};

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

PathKind kind_in(const struct stat& info) {
    if (S_ISREG(info.st_mode)) return PathKind::kFile;
    return S_ISDIR(info.st_mode) ? PathKind::kFolder : PathKind::kOther;
}

Status cannot_list(int number, const std::string& folder) {
    const auto kind = kind_of(folder);
    if (kind.ok() && kind.value() == PathKind::kBrokenLink)
        return not_found("'%s' is a link to what does not exist", shown(folder).c_str());
    return system_error(number, "list the folder", folder);
}

struct Listed {
    std::string name;
    unsigned char type = DT_UNKNOWN;  ///< type that readdir() gives
};

Result<std::vector<Listed>> list(const std::string& folder) {
    const std::unique_ptr<DIR, CloseFolder> open(
        SPLAT_FAULT("io.list") ? (errno = EACCES, nullptr) : ::opendir(folder.c_str()));
    if (open == nullptr) return cannot_list(errno, folder);
    std::vector<Listed> all;
    while (true) {
        errno = 0;
        const dirent* const found = ::readdir(open.get());
        if (found == nullptr) break;
        if (found->d_name[0] != '.') all.push_back({found->d_name, found->d_type});
    }
    if (errno != 0) return cannot_list(errno, folder);
    std::ranges::sort(all, [](const Listed& a, const Listed& b) { return a.name < b.name; });
    return all;
}

}  // namespace

Status make_folders(const fs::path& path) {
    std::error_code failed;
    fs::create_directories(path, failed);
    return failed ? system_error(failed.value(), "create the folder", path.string()) : Status();
}

Status write_folder(const fs::path& folder, const fs::path& temporary,
                    const std::function<Status(const fs::path&)>& write) {
    const RemovedFolder removed(temporary);
    SPLAT_TRY(write(temporary));
    std::error_code failed;
    fs::rename(temporary, folder, failed);
    return failed ? system_error(failed.value(), "create the folder", folder) : Status();
}

fs::path temporary_of(const fs::path& folder) {
    static std::atomic<unsigned> counter{0};
    return folder.parent_path() / format(".%s.%d-%u.tmp", folder.filename().c_str(),
                                         static_cast<int>(::getpid()), counter++);
}

Result<PathKind> kind_of(const std::string& path) {
    struct stat info {};
    errno = 0;
    if (!SPLAT_FAULT("io.stat") && ::stat(path.c_str(), &info) == 0) return kind_in(info);
    const int number = errno != 0 ? errno : EACCES;
    if (number != ENOENT && number != ENOTDIR && number != ELOOP)
        return system_error(number, "look at", path);
    const bool is_link = ::lstat(path.c_str(), &info) == 0 && S_ISLNK(info.st_mode);
    return is_link ? PathKind::kBrokenLink : PathKind::kNothing;
}

Result<bool> has_file(const std::string& path) {
    SPLAT_ASSIGN(const PathKind kind, kind_of(path));
    return kind == PathKind::kFile;
}

Result<std::vector<std::string>> names_in(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<Listed> all, list(folder));
    std::vector<std::string> names;
    for (const Listed& listed : all) names.push_back(listed.name);
    return names;
}

Result<std::vector<FolderEntry>> entries_in(const std::string& folder) {
    SPLAT_ASSIGN(const std::vector<Listed> all, list(folder));
    std::vector<FolderEntry> entries;
    for (const Listed& listed : all) {
        FolderEntry entry{listed.name, PathKind::kNothing};
        if (listed.type == DT_REG || listed.type == DT_DIR) {
            entry.kind = listed.type == DT_REG ? PathKind::kFile : PathKind::kFolder;
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
