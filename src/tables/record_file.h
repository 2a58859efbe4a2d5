#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/status.h"
#include "io/bytes.h"
#include "io/file.h"

namespace splat::tables {

/// Records of equal length, `<name>.npy` of shape [records, ...], and the CRC-32 of each, `<name>_crc.npy`.
struct RecordShape {
    std::string dtype;                 ///< "|u1" for numbers, "|S512" for text
    std::vector<std::uint64_t> shape;  ///< [records, ...]
    std::uint64_t bytes = 0;           ///< bytes per record
};

/// Writes records in any order.
class RecordWriter {
  public:
    /// Create the files with the disk space that they need, or go on with those that are there. Errors: as
    /// io::system_error().
    static Result<std::unique_ptr<RecordWriter>> open(const std::string& folder,
                                                      const std::string& name,
                                                      const RecordShape& shape);
    RecordWriter(const RecordWriter&) = delete;
    RecordWriter& operator=(const RecordWriter&) = delete;
    ~RecordWriter();

    /// Write one record of RecordShape::bytes bytes. Errors: as io::system_error().
    Status put(std::uint64_t record, io::Bytes bytes);

    /// The record was written, and reads back with its checksum.
    [[nodiscard]] bool holds(std::uint64_t record) const;

    /// Wait until the disk has all of it. Errors: as io::system_error().
    Status flush();

  private:
    RecordWriter(std::string path, std::string crc_path, std::uint64_t bytes)
        : path_(std::move(path)), crc_path_(std::move(crc_path)), bytes_(bytes) {}

    std::string path_, crc_path_;
    std::uint64_t bytes_;
    std::uint64_t start_ = 0, crc_start_ = 0;  ///< bytes of the files where the records start
    int file_ = -1, crcs_ = -1;
};

/// Reads records in any order. Thread-safe.
class RecordReader {
  public:
    /// Errors: kFormat for files of another shape, or too short; as io::read_file().
    static Result<std::unique_ptr<RecordReader>> open(const std::string& folder,
                                                      const std::string& name,
                                                      const RecordShape& shape);

    [[nodiscard]] std::uint64_t bytes() const { return bytes_; }

    /// Errors: kFormat for a damaged record, with the file and its number; kIo.
    Status read(std::uint64_t record, std::span<std::byte> to) const;

  private:
    RecordReader() = default;

    std::string path_;
    std::unique_ptr<io::Source> file_;
    std::uint64_t start_ = 0, bytes_ = 0;
    std::vector<std::uint32_t> crcs_;
};

}  // namespace splat::tables
