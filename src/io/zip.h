#pragma once

#include <string>
#include <unordered_map>
#include <vector>

#include "io/file.h"
#include "io/tensor_file.h"

namespace splat::io {

/// A file in a zip archive.
struct ZipEntry {
    std::string name;
    std::uint16_t method = 0;  ///< 0 stored, 8 deflate
    std::uint32_t crc = 0;
    std::uint64_t packed_bytes = 0;
    std::uint64_t bytes = 0;
    std::uint64_t start = 0;  ///< byte of the archive where its data starts
};

/// A zip archive, stored or deflated, with or without zip64, as PyTorch and NumPy write it.
///
/// Errors of open()  kFormat for an archive that is truncated or damaged, with wrong sizes,
///                   whose entries overlap or share a name, or hold more than the limits allow;
///                   kUnsupported for encryption, other methods and archives of several parts
/// Source            PKWARE's APPNOTE.TXT 6.3.10
class Zip {
  public:
    /// `source` must outlive the archive; `what` names it in messages.
    static Result<Zip> open(const Source& source, const std::string& what,
                            const DecodeLimits& limits = decode_limits());

    [[nodiscard]] const std::vector<ZipEntry>& entries() const { return entries_; }

    /// nullptr if there is none.
    [[nodiscard]] const ZipEntry* find(const std::string& name) const;

    /// All bytes of an entry. Errors: kFormat if they are damaged; the CRC is compared.
    Status read(const ZipEntry& entry, Buffer& to) const;

  private:
    const Source* source_ = nullptr;
    std::string what_;
    std::vector<ZipEntry> entries_;
    std::unordered_map<std::string, std::size_t> places_;
};

/// A file to put into an archive, in two pieces: one owned, one a view of others' bytes.
struct ZipMember {
    std::string name;
    Buffer head;
    Bytes body;
};

/// An archive of stored files without dates. Errors: kUnsupported from 4 GiB on, and for more than
/// 65534 members.
Result<FilePieces> write_zip(std::vector<ZipMember> members);

}  // namespace splat::io
