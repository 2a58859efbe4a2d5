#include "core/os/file.h"

#include <dirent.h>
#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "core/os/path.h"

namespace splat::os {
namespace {

int flags_of(Open how) {
    switch (how) {
        case Open::kRead:
            return O_RDONLY;
        case Open::kCreate:
            return O_WRONLY | O_CREAT | O_EXCL;
        case Open::kAppend:
            return O_WRONLY | O_CREAT | O_APPEND;
        case Open::kUpdate:
            return O_RDWR | O_CREAT;
        case Open::kUpdateOld:
            break;
    }
    return O_RDWR;
}

FileKind kind_of(mode_t mode) {
    if (S_ISREG(mode)) return FileKind::kFile;
    if (S_ISDIR(mode)) return FileKind::kFolder;
    return S_ISFIFO(mode) || S_ISSOCK(mode) ? FileKind::kPipe : FileKind::kOther;
}

int filled(int result, const struct stat& found, FileInfo& info) {
    if (result != 0) return result;
#if defined(__APPLE__)
    const timespec& changed = found.st_mtimespec;
#else
    const timespec& changed = found.st_mtim;
#endif
    info.kind = kind_of(found.st_mode);
    info.bytes = found.st_size > 0 ? static_cast<std::uint64_t>(found.st_size) : 0;
    info.changed_ns = std::int64_t{changed.tv_sec} * 1'000'000'000 + changed.tv_nsec;
    info.permissions = static_cast<int>(found.st_mode & 07777);
    info.links = found.st_nlink;
    info.number = found.st_ino;
    return 0;
}

struct CloseFolder {
    void operator()(DIR* folder) const { ::closedir(folder); }
};

}  // namespace

Handle open(const std::string& path, Open how) {
    return ::open(path.c_str(), flags_of(how) | O_CLOEXEC | O_NONBLOCK | O_NOCTTY, 0666);
}

int close(Handle file) {
    return ::close(file);
}

std::int64_t read(Handle file, void* to, std::size_t bytes, std::optional<std::uint64_t> offset) {
    return offset ? ::pread(file, to, bytes, static_cast<off_t>(*offset)) : ::read(file, to, bytes);
}

std::int64_t write(Handle file, const void* from, std::size_t bytes,
                   std::optional<std::uint64_t> offset) {
    return offset ? ::pwrite(file, from, bytes, static_cast<off_t>(*offset))
                  : ::write(file, from, bytes);
}

int flush(Handle file) {
#if defined(F_FULLFSYNC)
    // On macOS fsync leaves the drive's own cache as it is; some file systems have nothing more.
    if (::fcntl(file, F_FULLFSYNC) == 0) return 0;
#endif
    return ::fsync(file);
}

int resize(Handle file, std::uint64_t bytes) {
    return ::ftruncate(file, static_cast<off_t>(bytes));
}

int reserve(Handle file, std::uint64_t bytes) {
#if defined(__APPLE__)
    static_cast<void>(file), static_cast<void>(bytes);
    return 0;
#else
    const int failed = ::posix_fallocate(file, 0, static_cast<off_t>(bytes));
    return failed == EOPNOTSUPP || failed == EINVAL ? 0 : failed;
#endif
}

int examine(Handle file, FileInfo& info) {
    struct stat found {};
    return filled(::fstat(file, &found), found, info);
}

int examine(const std::string& path, FileInfo& info) {
    struct stat found {};
    return filled(::stat(path.c_str(), &found), found, info);
}

bool is_link(const std::string& path) {
    struct stat found {};
    return ::lstat(path.c_str(), &found) == 0 && S_ISLNK(found.st_mode);
}

bool is_own_folder(const std::string& path) {
    struct stat found {};
    return ::lstat(path.c_str(), &found) == 0 && S_ISDIR(found.st_mode) &&
           found.st_uid == ::geteuid();
}

int make_temporary_folder(std::string& path) {
    return ::mkdtemp(path.data()) != nullptr ? 0 : -1;
}

void set_permissions(Handle file, int permissions) {
    static_cast<void>(::fchmod(file, static_cast<mode_t>(permissions)));
}

int lock(Handle file, Lock kind, bool wait) {
    return ::flock(file, (kind == Lock::kShared ? LOCK_SH : LOCK_EX) | (wait ? 0 : LOCK_NB));
}

void unlock(Handle file) {
    ::flock(file, LOCK_UN);
}

int rename(const std::string& from, const std::string& to) {
    return std::rename(from.c_str(), to.c_str());
}

int remove(const std::string& path) {
    return std::remove(path.c_str());
}

int make_folder(const std::string& path) {
    return ::mkdir(path.c_str(), 0777);
}

void flush_folder_of(const std::string& path) {
    const int folder = ::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (folder < 0) return;
    static_cast<void>(::fsync(folder));
    ::close(folder);
}

Handle duplicate(Handle file) {
    return ::fcntl(file, F_DUPFD_CLOEXEC, 0);
}

int list(const std::string& folder, std::vector<Listed>& all) {
    const std::unique_ptr<DIR, CloseFolder> open(::opendir(folder.c_str()));
    if (open == nullptr) return -1;
    while (true) {
        errno = 0;
        const dirent* const found = ::readdir(open.get());
        if (found == nullptr) return errno == 0 ? 0 : -1;
        Listed listed{found->d_name, {}};
        if (found->d_type == DT_REG) listed.kind = FileKind::kFile;
        if (found->d_type == DT_DIR) listed.kind = FileKind::kFolder;
        all.push_back(std::move(listed));
    }
}

std::string reason(int number) {
    return std::strerror(number);
}

}  // namespace splat::os
