#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "core/status.h"
#include "io/bytes.h"

namespace splat::io {

/// Larger files are refused unless the caller says otherwise.
inline constexpr std::uint64_t kMaxFileBytes = std::uint64_t{16} << 30;

/// The whole file. Errors: kInvalidArgument if it cannot be opened or read, is no regular file, is
/// larger than `max_bytes`, or changes its size meanwhile; with path and the system's reason.
Result<Buffer> read_file(const std::string& path, std::uint64_t max_bytes = kMaxFileBytes);

/// Replace the file, or create it. Whoever opens the path, also after a crash, finds the old
/// contents or the new ones, never a part: the bytes go to "<path>.<process>-<number>.tmp", to the
/// disk, and then to their name. Errors: kInvalidArgument with path and the system's reason; the old
/// file is left as it was and the temporary one is removed.
Status write_file(const std::string& path, Bytes bytes);

/// The same of a file in pieces, one behind the other.
Status write_file(const std::string& path, std::span<const Bytes> pieces);

/// Create a file that is not there yet, for folders that get their name when all of their files are
/// written. Unlike write_file() it does not wait for the disk. Errors: kInvalidArgument with path and the
/// system's reason; a part of the file may then be there.
Status write_new_file(const std::string& path, Bytes bytes);

/// A whole file in place. What others write into it shows, and the system ends a process that touches what they have
/// cut off: ask unchanged() before each use.
class MappedFile {
  public:
    MappedFile() = default;
    MappedFile(const MappedFile&) = delete;
    MappedFile& operator=(const MappedFile&) = delete;
    virtual ~MappedFile() = default;

    [[nodiscard]] virtual Bytes bytes() const = 0;

    /// Errors: kInvalidArgument if the file has been written since it was opened. One that is replaced by another of
    /// its name, as write_file() does, stays as it was.
    [[nodiscard]] virtual Status unchanged() const = 0;
};

/// Bytes that are read piece by piece, so that large files are never held as a whole.
class Source {
  public:
    Source() = default;
    Source(const Source&) = delete;
    Source& operator=(const Source&) = delete;
    virtual ~Source() = default;

    [[nodiscard]] virtual std::uint64_t size() const = 0;

    /// Fill `to` with the bytes from `offset` on. Errors: kInvalidArgument if they are not all there,
    /// or cannot be read; `to` is then undefined. Several threads may read.
    virtual Status read(std::uint64_t offset, std::span<std::byte> to) const = 0;

    /// nullptr if it is no file, may not be mapped, or the system cannot do it. It may outlive the source.
    [[nodiscard]] virtual std::shared_ptr<const MappedFile> map() const { return nullptr; }
};

/// Bytes in memory, which must outlive it.
class MemorySource : public Source {
  public:
    explicit MemorySource(Bytes bytes) : bytes_(bytes) {}
    [[nodiscard]] std::uint64_t size() const override { return bytes_.size(); }
    Status read(std::uint64_t offset, std::span<std::byte> to) const override;

  private:
    Bytes bytes_;
};

/// A file, kept open. Its size is that at opening. mappable  map() may give it. Errors: as read_file().
Result<std::unique_ptr<Source>> open_source(const std::string& path,
                                            std::uint64_t max_bytes = kMaxFileBytes,
                                            bool mappable = false);

/// A file to be written: pieces of its own, and pieces that belong to others and must outlive it.
class FilePieces {
  public:
    void add(Buffer piece) {
        owned_.push_back(std::move(piece));
        pieces_.emplace_back(owned_.back());
    }
    void add_view(Bytes piece) { pieces_.push_back(piece); }
    [[nodiscard]] std::span<const Bytes> pieces() const { return pieces_; }
    [[nodiscard]] std::uint64_t size() const;
    [[nodiscard]] Buffer joined() const;

  private:
    std::vector<Buffer> owned_;  // moving one leaves its bytes where they are
    std::vector<Bytes> pieces_;
};

}  // namespace splat::io
