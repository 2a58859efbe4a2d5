#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <system_error>

#include "core/no_copy.h"
#include "core/os/file.h"
#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// Default limit of a file that is read.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{16} << 30;

/// What the system's error `number` means: kNotFound if there is no such file or folder, else kIo. The
/// sentence is "cannot <doing> '<path>': <the system's reason>".
Status system_error(int number, const char* doing, const std::string& path);
Status system_error(const std::error_code& failed, const char* doing, const std::string& path);

/// The extension of a path, in lower case and with the point; empty for none.
std::string extension_of(const std::string& path);

/// The whole file. Errors: kNotFound; kIo if the system refuses, the path is not a regular file, or the
/// file becomes shorter while it is read; kUnsupported if it is larger than `max_bytes`.
Result<Buffer> read_file(const std::string& path, std::uint64_t max_bytes = kMaxFileBytes);

/// Replace or create a file. The path holds the old contents or all of the new ones at any time, also
/// after a crash: the bytes are written to "<path>.<process>-<number>.tmp", flushed to the disk, and
/// renamed. A file that is replaced keeps its permissions, a symbolic link its target's place. Errors: as
/// system_error(), and kIo for what is not a regular file; the old file stays, the temporary one is removed.
Status write_file(const std::string& path, Bytes bytes);

/// Write consecutive pieces to one file.
Status write_file(const std::string& path, std::span<const Bytes> pieces);

/// Where the bytes of a file go, one piece after the other.
class ByteSink : NoCopy {
  public:
    virtual ~ByteSink() = default;

    /// Take the next bytes of the file.
    virtual Status put(Bytes bytes) = 0;
};

/// A file in memory.
class BufferSink : public ByteSink {
  public:
    Status put(Bytes bytes) override {
        put_bytes(file, bytes);
        return {};
    }
    Buffer file;
};

/// Write what `write` puts, piece by piece, so that the file never lies in memory as a whole. Errors: as the other
/// write_file(), and those of `write`.
Status write_file(const std::string& path, const std::function<Status(ByteSink&)>& write);

/// Create a file that does not exist, in a folder that is renamed once all of its files are written.
/// Unlike write_file() it does not flush to the disk. Errors: as system_error(); a part of the file may
/// remain.
Status write_new_file(const std::string& path, Bytes bytes);

/// Write all bytes to an open file, which `path` names in errors: from `offset` on, else where the file stands.
/// Interrupted and short writes go on. Errors: as system_error(); a part of the bytes may be written.
Status write_all(os::Handle file, Bytes bytes, const std::string& path,
                 std::optional<std::uint64_t> offset = {});

/// Append to a file, which is created unless it is there: all of the bytes or none. Errors: as
/// system_error(), and kIo for what is not a regular file.
Status append_file(const std::string& path, Bytes bytes);

/// A file mapped into memory. Writes of other processes are visible, and reading what they truncated ends this
/// process: call unchanged() before each use.
class MappedFile : NoCopy {
  public:
    virtual ~MappedFile() = default;

    [[nodiscard]] virtual Bytes bytes() const = 0;

    /// Errors: kIo if the file has been written since it was opened. A file replaced under
    /// its name, as write_file() does, stays valid.
    [[nodiscard]] virtual Status unchanged() const = 0;
};

/// Bytes read in pieces, so that large files never lie in memory as a whole.
class Source : NoCopy {
  public:
    virtual ~Source() = default;

    [[nodiscard]] virtual std::uint64_t size() const = 0;

    /// Fill `to` with the bytes from `offset` on. Errors: kFormat beyond size(),
    /// kIo if they cannot be read; `to` is then undefined. Thread-safe.
    virtual Status read(std::uint64_t offset, std::span<std::byte> to) const = 0;

    /// nullptr if it is not a file, may not be mapped, or the system cannot map it. May outlive the source. Reads the
    /// whole file now, if `ahead`; else what is accessed.
    [[nodiscard]] virtual std::shared_ptr<const MappedFile> map(
        [[maybe_unused]] bool ahead = true) const {
        return nullptr;
    }
};

/// Bytes in memory, which must outlive the source.
class MemorySource : public Source {
  public:
    explicit MemorySource(Bytes bytes) : bytes_(bytes) {}
    [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
    Status read(std::uint64_t offset, std::span<std::byte> to) const override;

  private:
    Bytes bytes_;
};

/// A file that stays open; its size is the one at opening. `mappable`: map() may map it. Errors: as
/// read_file().
Result<std::shared_ptr<const Source>> open_source(const std::string& path,
                                                  std::uint64_t max_bytes = kMaxFileBytes,
                                                  bool mappable = false);

/// A file to write: pieces that it owns, and views of others' bytes, which must outlive it.
class FilePieces {
  public:
    void add(Buffer piece) {
        owned_.push_back(std::move(piece));
        pieces_.emplace_back(owned_.back());
    }
    void add_view(Bytes piece) { pieces_.push_back(piece); }
    [[nodiscard]] std::span<const Bytes> pieces() const { return pieces_; }
    [[nodiscard]] std::uint64_t size() const {
        std::uint64_t bytes = 0;
        for (const Bytes piece : pieces_) bytes += piece.size();
        return bytes;
    }
    [[nodiscard]] Buffer joined() const {
        Buffer file;
        file.reserve(size());
        for (const Bytes piece : pieces_) put_bytes(file, piece);
        return file;
    }

  private:
    std::vector<Buffer> owned_;  // moving a buffer does not move its bytes
    std::vector<Bytes> pieces_;
};

}  // namespace splat::io
