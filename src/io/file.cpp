#include "io/file.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <utility>

#include "core/fault.h"
#include "core/os/memory.h"
#include "core/os/path.h"
#include "core/shown.h"

namespace splat::io {
namespace {

/// A system call that a fault point can make fail; like a real failure it returns -1 and sets errno.
#define SPLAT_SYSTEM(point, number, call) \
    (SPLAT_FAULT(point) ? (errno = (number), decltype(call){-1}) : (call))

class Descriptor : NoCopy {
  public:
    explicit Descriptor(os::Handle file) : file_(file) {}
    ~Descriptor() { static_cast<void>(release()); }

    [[nodiscard]] os::Handle get() const { return file_; }

    /// Closes now; -1 if the system reports a late write error.
    int release() {
        const os::Handle file = std::exchange(file_, os::kNoHandle);
        return file == os::kNoHandle ? 0 : os::close(file);
    }

  private:
    os::Handle file_;
};

/// Removes the file at the end unless it was renamed.
struct Temporary {
    std::string path;
    bool kept = false;
    ~Temporary() {
        if (!kept) os::remove(path);
    }
};

Status failed(const char* doing, const std::string& path) {
    return system_error(errno, doing, path);
}

/// The file that `path` names behind symbolic links, which may not exist.
std::string behind_links(const std::string& path) {
    constexpr int kMostLinks = 40;  // limit of Linux
    std::string target = path;
    std::error_code failed;
    for (int i = 0; i < kMostLinks && os::is_link(target); ++i) {
        const std::filesystem::path link = os::path_of(target);
        const std::filesystem::path to = std::filesystem::read_symlink(link, failed);
        if (failed) break;  // mingw's library reads none
        target = os::text_of(link.parent_path() / to);
    }
    return target;
}

/// Creates a file beside the target, or returns kNoHandle. A killed process of the same number, such as the first one
/// of a container, may have left files of such names.
os::Handle create_temporary(const std::string& target, std::string& path) {
    constexpr int kMostLeft = 100'000;
    os::Handle file = os::kNoHandle;
    for (int i = 0; file == os::kNoHandle && i < kMostLeft && (i == 0 || errno == EEXIST); ++i) {
        path = os::temporary_name(target);
        file = SPLAT_SYSTEM("io.create", EACCES, os::open(path, os::Open::kCreate));
    }
    return file;
}

/// A regular file of at most `max_bytes`, opened for reading.
Result<std::uint64_t> checked_size(const Descriptor& file, const std::string& path,
                                   std::uint64_t max_bytes, os::FileInfo& info) {
    if (file.get() == os::kNoHandle) return failed("open", path);
    if (os::examine(file.get(), info) != 0) return failed("examine", path);
    if (info.kind != os::FileKind::kFile)
        return error(Code::kIo, "'%s' is not a regular file", path.c_str());
    if (info.bytes > max_bytes)
        return unsupported("'%s' has %llu bytes, the limit is %llu", path.c_str(), llu(info.bytes),
                           llu(max_bytes));
    return info.bytes;
}

os::Handle open_to_read(const std::string& path) {
    return SPLAT_SYSTEM("io.open", ENOENT, os::open(path, os::Open::kRead));
}

Status read_all(os::Handle file, std::uint64_t offset, std::span<std::byte> to,
                const std::string& path) {
    while (!to.empty()) {
        const std::int64_t got =
            SPLAT_SYSTEM("io.read", EIO, os::read(file, to.data(), to.size(), offset));
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
    [[nodiscard]] std::shared_ptr<const MappedFile> map(bool ahead) const override;
    [[nodiscard]] Status unchanged() const {
        os::FileInfo now;
        if (os::examine(file_.get(), now) != 0) return failed("examine", path_);
        if (now.bytes == opened_.bytes && now.changed_ns == opened_.changed_ns) return {};
        return error(Code::kIo,
                     "'%s' was written since it was opened; open it again, and let others replace "
                     "it instead of writing into it",
                     path_.c_str());
    }
    [[nodiscard]] os::Handle handle() const { return file_.get(); }

  private:
    std::string path_;
    Descriptor file_;
    bool mappable_;
    std::uint64_t size_ = 0;
    os::FileInfo opened_;
};

class Mapping : public MappedFile {
  public:
    explicit Mapping(std::shared_ptr<const OpenFile> file) : file_(std::move(file)) {}
    ~Mapping() override {
        if (at_ != nullptr) os::unmap(at_, file_->size());
    }
    /// False if the system cannot. `ahead` reads the disk now, so that a failing disk fails here and not at the
    /// first access (since Linux 5.14).
    bool map(bool ahead) {
        at_ = SPLAT_FAULT("io.map") ? nullptr : os::map(file_->handle(), file_->size());
        return at_ != nullptr && (!ahead || os::populate_mapped(at_, file_->size()) == 0);
    }
    [[nodiscard]] Bytes bytes() const override {
        return {static_cast<const std::byte*>(at_), file_->size()};
    }
    [[nodiscard]] Status unchanged() const override { return file_->unchanged(); }

  private:
    std::shared_ptr<const OpenFile> file_;
    void* at_ = nullptr;
};

std::shared_ptr<const MappedFile> OpenFile::map(bool ahead) const {
    if (!mappable_) return nullptr;
    auto mapping = std::make_shared<Mapping>(shared_from_this());
    return mapping->map(ahead) ? mapping : nullptr;
}

class OpenFileSink : public ByteSink {
  public:
    OpenFileSink(os::Handle file, const std::string& path) : file_(file), path_(path) {}
    Status put(Bytes bytes) override { return write_all(file_, bytes, path_); }

  private:
    os::Handle file_;
    const std::string& path_;
};

std::int64_t write_some(os::Handle file, Bytes bytes, std::optional<std::uint64_t> offset) {
    if (SPLAT_FAULT("io.write")) {
        errno = ENOSPC;
        return -1;
    }
    return os::write(file, bytes.data(), bytes.size(), offset);
}

}  // namespace

Status system_error(int number, const char* doing, const std::string& path) {
    const bool missing = number == ENOENT || number == ENOTDIR;
    return error(missing ? Code::kNotFound : Code::kIo, "cannot %s '%s': %s", doing,
                 shown(path, os::kLongestPath).c_str(), os::reason(number).c_str());
}

Status system_error(const std::error_code& failed, const char* doing, const std::string& path) {
    return system_error(failed.default_error_condition().value(), doing, path);
}

Status write_all(os::Handle file, Bytes bytes, const std::string& path,
                 std::optional<std::uint64_t> offset) {
    while (!bytes.empty()) {
        const std::int64_t written = write_some(file, bytes, offset);
        if (written < 0 && errno == EINTR) continue;
        if (written == 0) errno = ENOSPC;
        if (written <= 0) return system_error(errno, "write", path);
        bytes = bytes.subspan(static_cast<std::size_t>(written));
        if (offset) *offset += static_cast<std::uint64_t>(written);
    }
    return {};
}

std::string extension_of(const std::string& path) {
    const std::size_t dot = path.rfind('.');
    if (dot == std::string::npos || dot < os::name_start(path)) return "";
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

Status write_file(const std::string& path, std::span<const Bytes> pieces) {
    return write_file(path, [pieces](ByteSink& to) -> Status {
        for (const Bytes piece : pieces) SPLAT_TRY(to.put(piece));
        return {};
    });
}

Status write_new_file(const std::string& path, Bytes bytes) {
    Descriptor file(SPLAT_SYSTEM("io.create", EACCES, os::open(path, os::Open::kCreate)));
    if (file.get() == os::kNoHandle) return failed("create", path);
    SPLAT_TRY(write_all(file.get(), bytes, path));
    return file.release() == 0 ? Status() : failed("close", path);
}

Status append_file(const std::string& path, Bytes bytes) {
    Descriptor file(SPLAT_SYSTEM("io.create", EACCES, os::open(path, os::Open::kAppend)));
    // ENXIO: a pipe without a reader.
    if (file.get() == os::kNoHandle && errno != ENXIO) return failed("open", path);
    os::FileInfo info;
    if (file.get() == os::kNoHandle || os::examine(file.get(), info) != 0 ||
        info.kind != os::FileKind::kFile)
        return error(Code::kIo, "cannot write '%s': it is not a regular file", path.c_str());
    Status status = write_all(file.get(), bytes, path);
    if (!status.ok() && os::resize(file.get(), info.bytes) != 0)
        status = error(status.code(), "%s; what was written of it stays at the end of the file",
                       status.message().c_str());
    if (file.release() != 0 && status.ok()) status = failed("close", path);
    return status;
}

Status write_file(const std::string& path, const std::function<Status(ByteSink&)>& write) {
    const std::string target = behind_links(path);
    if (!os::may_create(target)) return failed("create", path);
    os::FileInfo old;
    const bool replaced = os::examine(target, old) == 0;
    if (!replaced && errno == ELOOP) return failed("replace", path);
    if (replaced && old.kind != os::FileKind::kFile && old.kind != os::FileKind::kFolder)
        return error(Code::kIo, "'%s' is not a regular file", path.c_str());
    Temporary temporary;
    Descriptor file(create_temporary(target, temporary.path));
    if (file.get() == os::kNoHandle) {
        temporary.kept = true;  // there is none
        return failed("create", temporary.path);
    }
    if (replaced) os::set_permissions(file.get(), old.permissions);
    OpenFileSink sink(file.get(), temporary.path);
    SPLAT_TRY(write(sink));
    while (SPLAT_SYSTEM("io.fsync", EIO, os::flush(file.get())) != 0)
        if (errno != EINTR) return failed("flush", temporary.path);
    if (file.release() != 0) return failed("close", temporary.path);
    if (SPLAT_SYSTEM("io.rename", EXDEV, os::rename(temporary.path, target)) != 0)
        return failed("replace", path);
    temporary.kept = true;
    os::flush_folder_of(target);
    return {};
}

}  // namespace splat::io
