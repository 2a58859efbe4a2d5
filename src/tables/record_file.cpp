#include "tables/record_file.h"

#include <cerrno>
#include <limits>

#include "core/fault.h"
#include "io/compress.h"
#include "io/file.h"
#include "io/npy.h"

namespace splat::tables {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

Status write_at(os::Handle file, std::uint64_t offset, io::Bytes bytes, const std::string& path) {
    if (SPLAT_FAULT("tables.write")) return io::system_error(ENOSPC, "write", path);
    return io::write_all(file, bytes, path, offset);
}

/// A file of this header and size, created unless it is there; its space is taken now where the file system
/// can do that, so that a full disk fails here.
Result<os::Handle> open_sized(const std::string& path, const io::Buffer& header,
                              std::uint64_t bytes) {
    const os::Handle file = os::open(path, os::Open::kUpdate);
    if (file == os::kNoHandle) return io::system_error(errno, "create", path);
    const std::uint64_t size = header.size() + bytes;
    os::FileInfo info;
    Status status;
    if (os::examine(file, info) != 0) status = io::system_error(errno, "examine", path);
    if (status.ok() && info.bytes != size) {
        const int taken = SPLAT_FAULT("tables.allocate") ? ENOSPC : os::reserve(file, size);
        if (taken != 0)
            status = Status(Code::kIo, format("cannot take %llu bytes for '%s': %s", llu(size),
                                              path.c_str(), os::reason(taken).c_str()));
        else if (os::resize(file, size) != 0)
            status = io::system_error(errno, "resize", path);
    }
    if (status.ok()) status = write_at(file, 0, header, path);
    if (status.ok()) return file;
    os::close(file);
    return status;
}

/// The file begins with this header and has `bytes` bytes after it.
Result<std::shared_ptr<const io::Source>> open_checked(const std::string& path,
                                                       const io::Buffer& header,
                                                       std::uint64_t bytes) {
    SPLAT_ASSIGN(auto file, io::open_source(path, kNoLimit));
    io::Buffer found(std::min<std::uint64_t>(header.size(), file->size()));
    SPLAT_TRY(file->read(0, found));
    if (found != header)
        return damaged("'%s' is not the .npy file that its store.json describes", path.c_str());
    if (file->size() == header.size() + bytes) return file;
    return damaged("'%s' has %llu bytes, expected %llu: it is truncated or damaged", path.c_str(),
                   llu(file->size()), llu(header.size() + bytes));
}

}  // namespace

RecordFile::RecordFile(const std::string& folder, const std::string& name, const RecordShape& shape)
    : path_(folder + "/" + name + ".npy"),
      crc_path_(folder + "/" + name + "_crc.npy"),
      header_(io::write_npy_header(shape.dtype, shape.shape)),
      crc_header_(io::write_npy_header("<u4", {shape.shape.front()})),
      bytes_(shape.bytes),
      crcs_(shape.shape.front()) {}

RecordFile::~RecordFile() {
    for (const os::Handle file : {file_, crc_file_})
        if (file != os::kNoHandle) os::close(file);
}

Status RecordFile::open_to_read() {
    SPLAT_ASSIGN(source_, open_checked(path_, header_, crcs_.size() * bytes_));
    const auto crcs = std::as_writable_bytes(std::span(crcs_));
    SPLAT_ASSIGN(const auto crc_source, open_checked(crc_path_, crc_header_, crcs.size()));
    return crc_source->read(crc_header_.size(), crcs);
}

Result<std::unique_ptr<RecordFile>> RecordFile::open(const std::string& folder,
                                                     const std::string& name,
                                                     const RecordShape& shape) {
    std::unique_ptr<RecordFile> opened(new RecordFile(folder, name, shape));
    SPLAT_TRY(opened->open_to_read());
    return opened;
}

Result<std::unique_ptr<RecordFile>> RecordFile::create(const std::string& folder,
                                                       const std::string& name,
                                                       const RecordShape& shape) {
    std::unique_ptr<RecordFile> made(new RecordFile(folder, name, shape));
    const std::uint64_t records = made->crcs_.size();
    SPLAT_ASSIGN(made->file_, open_sized(made->path_, made->header_, records * shape.bytes));
    SPLAT_ASSIGN(made->crc_file_,
                 open_sized(made->crc_path_, made->crc_header_, records * sizeof(std::uint32_t)));
    SPLAT_TRY(made->open_to_read());
    return made;
}

Status RecordFile::put(std::uint64_t record, io::Bytes bytes) {
    SPLAT_ASSERT(bytes.size() == bytes_);
    SPLAT_TRY(write_at(file_, header_.size() + record * bytes_, bytes, path_));
    const std::uint32_t crc = io::crc32_of(bytes);
    return write_at(crc_file_, crc_header_.size() + record * sizeof crc,
                    std::as_bytes(std::span(&crc, 1)), crc_path_);
}

Status RecordFile::flush() {
    for (const os::Handle file : {file_, crc_file_})
        while (os::flush(file) != 0)
            if (errno != EINTR) return io::system_error(errno, "flush", path_);
    return {};
}

Status RecordFile::read(std::uint64_t record, std::span<std::byte> to) const {
    SPLAT_ASSERT(to.size() == bytes_ && record < crcs_.size());
    SPLAT_TRY(source_->read(header_.size() + record * bytes_, to));
    if (io::crc32_of(to) == crcs_[record]) return {};
    return damaged(
        "'%s': record %llu does not have its checksum; the file is damaged: remove the "
        "store and import again",
        path_.c_str(), llu(record));
}

}  // namespace splat::tables
