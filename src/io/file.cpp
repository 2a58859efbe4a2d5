#include "io/file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cctype>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>

#include "core/fault.h"
#include "core/shown.h"

namespace splat::io {
namespace {

/// A system call that a fault point can make fail; like a real failure it returns -1 and sets errno.
#define SPLAT_SYSTEM(point, number, call) \
    (SPLAT_FAULT(point) ? (errno = (number), decltype(call){-1}) : (call))

class Descriptor : NoCopy {
  public:
    explicit Descriptor(int fd) : fd_(fd) {}
    ~Descriptor() { static_cast<void>(release()); }

    [[nodiscard]] int get() const { return fd_; }

    /// Closes now; -1 if the system reports a late write error.
    int release() {
        const int fd = fd_;
        fd_ = -1;
        return fd < 0 ? 0 : ::close(fd);
    }

  private:
    int fd_;
};

/// Removes the file at the end unless it was renamed.
struct Temporary {
    std::string path;
    bool kept = false;
    ~Temporary() {
        if (!kept) std::remove(path.c_str());
    }
};

Status failed(const char* doing, const std::string& path) {
    return system_error(errno, doing, path);
}

std::string folder_of(const std::string& path) {
    const std::size_t slash = path.rfind('/');
    if (slash == std::string::npos) return ".";
    return slash == 0 ? "/" : path.substr(0, slash);
}

/// Flushes the new name with its folder. Some file systems cannot; the file is complete anyway.
void flush_folder(const std::string& path) {
    const Descriptor folder(::open(folder_of(path).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (folder.get() >= 0) static_cast<void>(::fsync(folder.get()));
}

/// The file that `path` names behind symbolic links, which may not exist.
std::string behind_links(const std::string& path) {
    constexpr int kMostLinks = 40;  // limit of Linux
    std::filesystem::path target = path;
    std::error_code failed;
    for (int i = 0; i < kMostLinks && std::filesystem::is_symlink(target, failed); ++i)
        target = target.parent_path() / std::filesystem::read_symlink(target, failed);
    return target;
}

/// Beside the target; shortened where the system does not take longer names.
std::string temporary_name(const std::string& target) {
    static std::atomic<unsigned> counter{0};
    const std::string suffix =
        "." + std::to_string(::getpid()) + "-" + std::to_string(counter++) + ".tmp";
    const std::size_t name = target.rfind('/') + 1;  // 0 without a folder
    return target.substr(0, name + NAME_MAX - suffix.size()) + suffix;
}

/// Creates a file beside the target, or returns -1. A killed process of the same number, such as the first one of a
/// container, may have left files of such names.
int create_temporary(const std::string& target, std::string& path) {
    constexpr int kMostLeft = 100'000;
    int file = -1;
    for (int i = 0; file < 0 && i < kMostLeft && (i == 0 || errno == EEXIST); ++i) {
        path = temporary_name(target);
        file = SPLAT_SYSTEM("io.create", EACCES,
                            ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    }
    return file;
}

/// A regular file of at most `max_bytes`, opened for reading.
Result<std::uint64_t> checked_size(const Descriptor& file, const std::string& path,
                                   std::uint64_t max_bytes, struct stat& info) {
    if (file.get() < 0) return failed("open", path);
    if (::fstat(file.get(), &info) != 0) return failed("examine", path);
    if (!S_ISREG(info.st_mode)) return error(Code::kIo, "'%s' is not a regular file", path.c_str());
    const auto size = static_cast<std::uint64_t>(info.st_size);
    if (size > max_bytes)
        return unsupported("'%s' has %llu bytes, the limit is %llu", path.c_str(), llu(size),
                           llu(max_bytes));
    return size;
}

/// Does not wait for the writer of a FIFO, which checked_size() refuses.
int open_to_read(const std::string& path) {
    return SPLAT_SYSTEM("io.open", ENOENT,
                        ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
}

Status read_all(int fd, std::uint64_t offset, std::span<std::byte> to, const std::string& path) {
    while (!to.empty()) {
        const ssize_t got = SPLAT_SYSTEM(
            "io.read", EIO, ::pread(fd, to.data(), to.size(), static_cast<off_t>(offset)));
        if (got < 0 && errno == EINTR) continue;
        if (got < 0) return failed("read", path);
        if (got == 0)
            return error(Code::kIo, "'%s' became shorter while it was read", path.c_str());
        to = to.subspan(static_cast<std::size_t>(got));
        offset += static_cast<std::uint64_t>(got);
    }
    return {};
}

Status check_range(std::uint64_t size, std::uint64_t offset, std::uint64_t count) {
    if (offset <= size && count <= size - offset) return {};
    return damaged("%llu bytes requested at byte %llu of %llu; the file is truncated or damaged",
                   llu(count), llu(offset), llu(size));
}

class OpenFile : public Source, public std::enable_shared_from_this<OpenFile> {
  public:
    OpenFile(std::string path, bool mappable)
        : path_(std::move(path)), file_(open_to_read(path_)), mappable_(mappable) {}

    Status examine(std::uint64_t max_bytes) {
        SPLAT_ASSIGN(size_, checked_size(file_, path_, max_bytes, opened_));
        return {};
    }
    [[nodiscard]] std::uint64_t size() const override { return size_; }
    Status read(std::uint64_t offset, std::span<std::byte> to) const override {
        SPLAT_TRY(check_range(size_, offset, to.size()));
        return read_all(file_.get(), offset, to, path_);
    }
    [[nodiscard]] std::shared_ptr<const MappedFile> map() const override;
    [[nodiscard]] Status unchanged() const {
        struct stat now {};
        if (::fstat(file_.get(), &now) != 0) return failed("examine", path_);
        if (now.st_size == opened_.st_size && now.st_mtim.tv_sec == opened_.st_mtim.tv_sec &&
            now.st_mtim.tv_nsec == opened_.st_mtim.tv_nsec)
            return {};
        return error(Code::kIo,
                     "'%s' was written since it was opened; open it again, and let others replace "
                     "it instead of writing into it",
                     path_.c_str());
    }
    [[nodiscard]] int descriptor() const { return file_.get(); }

  private:
    std::string path_;
    Descriptor file_;
    bool mappable_;
    std::uint64_t size_ = 0;
    struct stat opened_ {};
};

class Mapping : public MappedFile {
  public:
    explicit Mapping(std::shared_ptr<const OpenFile> file) : file_(std::move(file)) {}
    ~Mapping() override {
        if (at_ != nullptr) ::munmap(at_, file_->size());
    }
    /// False if the system cannot. Reads the disk now, so that a failing disk fails here and not at the
    /// first access (since Linux 5.14).
    bool map() {
        void* const at = SPLAT_FAULT("io.map") ? MAP_FAILED
                                               : ::mmap(nullptr, file_->size(), PROT_READ,
                                                        MAP_PRIVATE, file_->descriptor(), 0);
        if (at == MAP_FAILED) return false;
        at_ = at;
#ifdef MADV_POPULATE_READ
        return ::madvise(at_, file_->size(), MADV_POPULATE_READ) == 0 || errno == EINVAL;
#else
        return true;
#endif
    }
    [[nodiscard]] Bytes bytes() const override {
        return {static_cast<const std::byte*>(at_), file_->size()};
    }
    [[nodiscard]] Status unchanged() const override {
        return file_->unchanged();
    }

  private:
    std::shared_ptr<const OpenFile> file_;
    void* at_ = nullptr;
};

std::shared_ptr<const MappedFile> OpenFile::map() const {
    if (!mappable_) return nullptr;
    auto mapping = std::make_shared<Mapping>(shared_from_this());
    return mapping->map() ? mapping : nullptr;
}

ssize_t write_some(int file, Bytes bytes, std::optional<std::uint64_t> offset) {
    if (SPLAT_FAULT("io.write")) {
        errno = ENOSPC;
        return -1;
    }
    return offset ? ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(*offset))
                  : ::write(file, bytes.data(), bytes.size());
}

}  // namespace

Status system_error(int number, const char* doing, const std::string& path) {
    const bool missing = number == ENOENT || number == ENOTDIR;
    return error(missing ? Code::kNotFound : Code::kIo, "cannot %s '%s': %s", doing,
                 shown(path, PATH_MAX).c_str(), std::strerror(number));
}

Status write_all(int file, Bytes bytes, const std::string& path,
                 std::optional<std::uint64_t> offset) {
    while (!bytes.empty()) {
        const ssize_t written = write_some(file, bytes, offset);
        if (written < 0 && errno == EINTR) continue;
        if (written == 0) errno = ENOSPC;
        if (written <= 0) return system_error(errno, "write", path);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        if (offset) *offset += static_cast<std::uint64_t>(written);
    }
    return {};
}

std::string extension_of(const std::string& path) {
    const std::size_t dot = path.find_last_of("./");
    if (dot == std::string::npos || path[dot] == '/') return "";
    std::string extension = path.substr(dot);
    for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    return extension;
}

Result<Buffer> read_file(const std::string& path, std::uint64_t max_bytes) {
    OpenFile file(path, false);
    SPLAT_TRY(file.examine(max_bytes));
    Buffer bytes(file.size());
    SPLAT_TRY(file.read(0, bytes));
    return bytes;
}

Result<std::shared_ptr<const Source>> open_source(const std::string& path, std::uint64_t max_bytes,
                                                  bool mappable) {
    const auto file = std::make_shared<OpenFile>(path, mappable);
    SPLAT_TRY(file->examine(max_bytes));
    return std::shared_ptr<const Source>(file);
}

Status MemorySource::read(std::uint64_t offset, std::span<std::byte> to) const {
    SPLAT_TRY(check_range(bytes_.size(), offset, to.size()));
    const Bytes from = bytes_.subspan(offset, to.size());
    std::ranges::copy(from, to.begin());
    return {};
}

Status write_file(const std::string& path, Bytes bytes) {
    return write_file(path, std::span(&bytes, 1));
}

Status write_new_file(const std::string& path, Bytes bytes) {
    Descriptor file(SPLAT_SYSTEM(
        "io.create", EACCES, ::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666)));
    if (file.get() < 0) return failed("create", path);
    SPLAT_TRY(write_all(file.get(), bytes, path));
    return file.release() == 0 ? Status() : failed("close", path);
}

Status append_file(const std::string& path, Bytes bytes) {
    // Does not wait for the reader of a FIFO.
    Descriptor file(SPLAT_SYSTEM(
        "io.create", EACCES,
        ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_NONBLOCK | O_CLOEXEC, 0666)));
    if (file.get() < 0 && errno != ENXIO) return failed("open", path);
    struct stat info {};
    if (file.get() < 0 || ::fstat(file.get(), &info) != 0 || !S_ISREG(info.st_mode))
        return error(Code::kIo, "cannot write '%s': it is not a regular file", path.c_str());
    Status status = write_all(file.get(), bytes, path);
    if (!status.ok() && ::ftruncate(file.get(), info.st_size) != 0)
        status = error(status.code(), "%s; what was written of it stays at the end of the file",
                       status.message().c_str());
    if (file.release() != 0 && status.ok()) status = failed("close", path);
    return status;
}

Status write_file(const std::string& path, std::span<const Bytes> pieces) {
    const std::string target = behind_links(path);
    struct stat old {};
    const bool replaced = ::stat(target.c_str(), &old) == 0;
    if (!replaced && errno == ELOOP) return failed("replace", path);
    if (replaced && !S_ISREG(old.st_mode) && !S_ISDIR(old.st_mode))
        return error(Code::kIo, "'%s' is not a regular file", path.c_str());
    Temporary temporary;
    Descriptor file(create_temporary(target, temporary.path));
    if (file.get() < 0) {
        temporary.kept = true;  // there is none
        return failed("create", temporary.path);
    }
    // Some file systems have no permissions.
    if (replaced) static_cast<void>(::fchmod(file.get(), old.st_mode & 07777));
    for (const Bytes piece : pieces) SPLAT_TRY(write_all(file.get(), piece, temporary.path));
    while (SPLAT_SYSTEM("io.fsync", EIO, ::fsync(file.get())) != 0)
        if (errno != EINTR) return failed("flush", temporary.path);
    if (file.release() != 0) return failed("close", temporary.path);
    if (SPLAT_SYSTEM("io.rename", EXDEV, ::rename(temporary.path.c_str(), target.c_str())) != 0)
        return failed("replace", path);
    temporary.kept = true;
    flush_folder(target);
    return {};
}

}  // namespace splat::io
