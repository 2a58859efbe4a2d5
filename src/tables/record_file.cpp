#include "tables/record_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <limits>

#include "core/fault.h"
#include "io/compress.h"
#include "io/npy.h"
#include "io/write_all.h"

namespace splat::tables {
namespace {

constexpr std::uint64_t kNoLimit = std::numeric_limits<std::int64_t>::max();

std::string path_of(const std::string& folder, const std::string& name, const char* end) {
    return folder + "/" + name + end;
}

io::Buffer header_of(const RecordShape& shape) {
    return io::write_npy_header(shape.dtype, shape.shape);
}

io::Buffer crc_header_of(const RecordShape& shape) {
    return io::write_npy_header("<u4", {shape.shape.front()});
}

Status write_at(int file, std::uint64_t offset, io::Bytes bytes, const std::string& path) {
    if (SPLAT_FAULT("tables.write")) return io::system_error(ENOSPC, "write", path);
    return io::write_all(file, bytes, path, offset);
}

bool read_at(int file, std::uint64_t offset, std::span<std::byte> to) {
    return ::pread(file, to.data(), to.size(), static_cast<off_t>(offset)) ==
           static_cast<ssize_t>(to.size());
}

/// A file of this header and size, created unless it is there; its space is taken now where the file system
/// can do that, so that a full disk fails here.
Result<int> open_sized(const std::string& path, const io::Buffer& header, std::uint64_t bytes) {
    const int file = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
    if (file < 0) return io::system_error(errno, "create", path);
    const auto size = static_cast<off_t>(header.size() + bytes);
    struct stat info {};
    Status status;
    if (::fstat(file, &info) != 0) status = io::system_error(errno, "examine", path);
    if (status.ok() && info.st_size != size) {
        const int taken =
            SPLAT_FAULT("tables.allocate") ? ENOSPC : ::posix_fallocate(file, 0, size);
        if (taken != 0 && taken != EOPNOTSUPP && taken != EINVAL)
            status = Status(Code::kIo, format("cannot take %llu bytes for '%s': %s",
                                              static_cast<unsigned long long>(size), path.c_str(),
                                              std::strerror(taken)));
        else if (::ftruncate(file, size) != 0)
            status = io::system_error(errno, "resize", path);
    }
    if (status.ok()) status = write_at(file, 0, header, path);
    if (status.ok()) return file;
    ::close(file);
    return status;
}

/// The file begins with this header and has `bytes` bytes after it.
Status check_file(const io::Source& file, const io::Buffer& header, std::uint64_t bytes,
                  const std::string& path) {
    io::Buffer found(std::min<std::uint64_t>(header.size(), file.size()));
    SPLAT_TRY(file.read(0, found));
    if (found != header)
        return error(Code::kFormat, "'%s' is not the .npy file that its store.json describes",
                     path.c_str());
    if (file.size() == header.size() + bytes) return {};
    return error(Code::kFormat, "'%s' has %llu bytes, expected %llu: it is truncated or damaged",
                 path.c_str(), static_cast<unsigned long long>(file.size()),
                 static_cast<unsigned long long>(header.size() + bytes));
}

}  // namespace

Result<std::unique_ptr<RecordWriter>> RecordWriter::open(const std::string& folder,
                                                         const std::string& name,
                                                         const RecordShape& shape) {
    std::unique_ptr<RecordWriter> writer(new RecordWriter(
        path_of(folder, name, ".npy"), path_of(folder, name, "_crc.npy"), shape.bytes));
    const io::Buffer header = header_of(shape);
    const io::Buffer crc_header = crc_header_of(shape);
    const std::uint64_t records = shape.shape.front();
    writer->start_ = header.size();
    writer->crc_start_ = crc_header.size();
    SPLAT_ASSIGN(writer->file_, open_sized(writer->path_, header, records * shape.bytes));
    SPLAT_ASSIGN(writer->crcs_,
                 open_sized(writer->crc_path_, crc_header, records * sizeof(std::uint32_t)));
    return writer;
}

RecordWriter::~RecordWriter() {
    for (const int file : {file_, crcs_})
        if (file >= 0) ::close(file);
}

Status RecordWriter::put(std::uint64_t record, io::Bytes bytes) {
    SPLAT_ASSERT(bytes.size() == bytes_);
    SPLAT_TRY(write_at(file_, start_ + record * bytes_, bytes, path_));
    const std::uint32_t crc = io::crc32_of(bytes);
    return write_at(crcs_, crc_start_ + record * sizeof crc, std::as_bytes(std::span(&crc, 1)),
                    crc_path_);
}

bool RecordWriter::holds(std::uint64_t record) const {
    io::Buffer bytes(bytes_);
    std::uint32_t crc = 0;
    return read_at(file_, start_ + record * bytes_, bytes) &&
           read_at(crcs_, crc_start_ + record * sizeof crc,
                   std::as_writable_bytes(std::span(&crc, 1))) &&
           crc == io::crc32_of(bytes);
}

Status RecordWriter::flush() {
    for (const int file : {file_, crcs_})
        while (::fsync(file) != 0)
            if (errno != EINTR) return io::system_error(errno, "flush", path_);
    return {};
}

Result<std::unique_ptr<RecordReader>> RecordReader::open(const std::string& folder,
                                                         const std::string& name,
                                                         const RecordShape& shape) {
    std::unique_ptr<RecordReader> reader(new RecordReader);
    reader->path_ = path_of(folder, name, ".npy");
    reader->bytes_ = shape.bytes;
    const std::uint64_t records = shape.shape.front();
    const io::Buffer header = header_of(shape);
    reader->start_ = header.size();
    SPLAT_ASSIGN(reader->file_, io::open_source(reader->path_, kNoLimit));
    SPLAT_TRY(check_file(*reader->file_, header, records * shape.bytes, reader->path_));
    const std::string crc_path = path_of(folder, name, "_crc.npy");
    SPLAT_ASSIGN(const auto crcs, io::open_source(crc_path));
    const io::Buffer crc_header = crc_header_of(shape);
    SPLAT_TRY(check_file(*crcs, crc_header, records * sizeof(std::uint32_t), crc_path));
    reader->crcs_.resize(records);
    SPLAT_TRY(crcs->read(crc_header.size(), std::as_writable_bytes(std::span(reader->crcs_))));
    return reader;
}

Status RecordReader::read(std::uint64_t record, std::span<std::byte> to) const {
    SPLAT_ASSERT(to.size() == bytes_ && record < crcs_.size());
    SPLAT_TRY(file_->read(start_ + record * bytes_, to));
    if (io::crc32_of(to) == crcs_[record]) return {};
    return error(Code::kFormat,
                 "'%s': record %llu does not have its checksum; the file is damaged: remove the "
                 "store and import again",
                 path_.c_str(), static_cast<unsigned long long>(record));
}

}  // namespace splat::tables
