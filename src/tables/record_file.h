#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/os/file.h"
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

/// Records in any order.
class RecordFile : NoCopy {
  public:
    /// To read; thread-safe. Errors: kFormat for files of another shape, or too short; as io::read_file().
    static Result<std::unique_ptr<RecordFile>> open(const std::string& folder,
                                                    const std::string& name,
                                                    const RecordShape& shape);
    /// To write: create the files with the disk space that they need, or go on with those that are there. Errors: as
    /// io::system_error().
    static Result<std::unique_ptr<RecordFile>> create(const std::string& folder,
                                                      const std::string& name,
                                                      const RecordShape& shape);
    ~RecordFile();

    /// `to` has RecordShape::bytes bytes. Errors: kFormat for a record that is damaged or was not there at opening,
    /// with the file and its number; kIo.
    Status read(std::uint64_t record, std::span<std::byte> to) const;

    /// Write one record of RecordShape::bytes bytes. Errors: as io::system_error().
    Status put(std::uint64_t record, io::Bytes bytes);

    /// Wait until the disk has all of it. Errors: as io::system_error().
    Status flush();

  private:
    RecordFile(const std::string& folder, const std::string& name, const RecordShape& shape);
    Status open_to_read();

    std::string path_, crc_path_;
    io::Buffer header_, crc_header_;
    std::uint64_t bytes_;
    std::vector<std::uint32_t> crcs_;  ///< checksums at opening
    std::shared_ptr<const io::Source> source_;
    os::Handle file_ = os::kNoHandle, crc_file_ = os::kNoHandle;  ///< to write
};

}  // namespace splat::tables
