#include "io/zip.h"

#include <algorithm>

#include "core/checked_math.h"
#include "io/compress.h"
#include "io/reader.h"

namespace splat::io {
namespace {

constexpr std::uint32_t kLocalMagic = 0x04034b50;
constexpr std::uint32_t kEntryMagic = 0x02014b50;
constexpr std::uint32_t kEndMagic = 0x06054b50;
constexpr std::uint32_t kEnd64Magic = 0x06064b50;
constexpr std::uint32_t kLocator64Magic = 0x07064b50;
constexpr std::uint64_t kLocalBytes = 30;
constexpr std::uint64_t kDirectoryEntryBytes = 46;
constexpr std::uint64_t kEndBytes = 22;
constexpr std::uint64_t kEnd64Bytes = 56;
constexpr std::uint64_t kLocator64Bytes = 20;
constexpr std::uint64_t kMaxComment = 0xFFFF;
constexpr std::uint16_t kExtra64 = 1;
constexpr std::uint16_t kEncrypted = 1U << 0U;
constexpr std::uint16_t kSizesFollow = 1U << 3U;  // the local header has zeros for them
constexpr std::uint16_t kStored = 0;
constexpr std::uint16_t kDeflated = 8;
constexpr std::uint64_t kIn32 = 0xFFFF'FFFF;  // in a 32-bit field: the zip64 field holds the value
constexpr std::uint64_t kIn16 = 0xFFFF;

/// Reads the directory of an archive.
class DirectoryReader {
  public:
    DirectoryReader(const Source& source, std::string what)
        : source_(source), what_(std::move(what)) {}

    Result<std::vector<ZipEntry>> run(const DecodeLimits& limits) {
        SPLAT_TRY(find_end());
        if (count_ > limits.max_items)
            return bad(
                format("%llu entries, the limit is %llu", llu(count_), llu(limits.max_items)));
        if (count_ > bytes_ / kDirectoryEntryBytes)
            return bad("more entries than its directory has room for");
        SPLAT_ASSIGN(const Buffer directory, piece(start_, bytes_));
        Reader reader(directory, what_ + ": directory");
        std::vector<ZipEntry> entries;
        DecodeBudget budget(source_.size(), limits);
        for (std::uint64_t i = 0; i < count_; ++i) {
            SPLAT_ASSIGN(ZipEntry entry, read_entry(reader));
            SPLAT_TRY(check_sizes(entry));
            SPLAT_TRY(budget.take(entry.bytes, 1, what_ + ": " + entry.name));
            entries.push_back(std::move(entry));
        }
        if (reader.left() != 0)
            return bad(std::to_string(reader.left()) + " bytes after the last directory entry");
        SPLAT_TRY(check_overlaps());
        return entries;
    }

  private:
    struct Extent {
        std::uint64_t start;
        std::uint64_t end;
    };

    [[nodiscard]] Status bad(const std::string& problem) const {
        return damaged("%s: %s; the archive is truncated or damaged", what_.c_str(),
                       problem.c_str());
    }

    [[nodiscard]] Status unsupported(const std::string& problem) const {
        return splat::unsupported("%s: %s", what_.c_str(), problem.c_str());
    }

    Result<Buffer> piece(std::uint64_t start, std::uint64_t bytes) const {
        if (start > source_.size() || bytes > source_.size() - start)
            return bad(format("it has no byte %llu", llu(start)));
        Buffer buffer(bytes);
        SPLAT_TRY(source_.read(start, buffer));
        return buffer;
    }

    /// The record at the end of the archive, with the place of the directory.
    Status find_end() {
        const std::uint64_t size = source_.size();
        const std::uint64_t tail_bytes = std::min(size, kEndBytes + kMaxComment);
        SPLAT_ASSIGN(const Buffer tail, piece(size - tail_bytes, tail_bytes));
        for (std::size_t at = tail.size() + 1 - std::min(tail.size() + 1, kEndBytes); at-- > 0;) {
            const std::byte* record = tail.data() + at;
            if (number<std::uint32_t>(record) != kEndMagic ||
                number<std::uint16_t>(record + 20) != tail.size() - at - kEndBytes)
                continue;
            return read_end(Bytes(record, kEndBytes), size - tail_bytes + at);
        }
        return bad("there is no end-of-directory record");
    }

    Status read_end(Bytes record, std::uint64_t at) {
        const auto disk = number<std::uint16_t>(record.data() + 4);
        const auto directory_disk = number<std::uint16_t>(record.data() + 6);
        const auto here = number<std::uint16_t>(record.data() + 8);
        count_ = number<std::uint16_t>(record.data() + 10);
        bytes_ = number<std::uint32_t>(record.data() + 12);
        start_ = number<std::uint32_t>(record.data() + 16);
        const bool wide = at >= kLocator64Bytes && is_locator(at - kLocator64Bytes);
        if (wide) return read_end64(at - kLocator64Bytes);
        if (disk != 0 || directory_disk != 0 || here != count_)
            return unsupported("an archive of several parts");
        return check_place(at);
    }

    [[nodiscard]] bool is_locator(std::uint64_t at) const {
        std::byte magic[4];
        return source_.read(at, magic).ok() && number<std::uint32_t>(magic) == kLocator64Magic;
    }

    Status read_end64(std::uint64_t locator_at) {
        SPLAT_ASSIGN(const Buffer locator, piece(locator_at, kLocator64Bytes));
        const auto at = number<std::uint64_t>(locator.data() + 8);
        SPLAT_ASSIGN(const Buffer record, piece(at, kEnd64Bytes));
        const auto rest = number<std::uint64_t>(record.data() + 4);
        if (number<std::uint32_t>(record.data()) != kEnd64Magic ||
            checked_add(at, 12).value_or(UINT64_MAX) > locator_at || rest != locator_at - at - 12)
            return bad("its zip64 record is not where its locator says");
        const auto here = number<std::uint64_t>(record.data() + 24);
        count_ = number<std::uint64_t>(record.data() + 32);
        bytes_ = number<std::uint64_t>(record.data() + 40);
        start_ = number<std::uint64_t>(record.data() + 48);
        if (number<std::uint64_t>(record.data() + 16) != 0 || here != count_)
            return unsupported("an archive of several parts");
        return check_place(at);
    }

    /// Checks that the directory ends where its end record starts.
    Status check_place(std::uint64_t end) {
        const auto sum = checked_add(start_, bytes_);
        if (sum && *sum == end) return {};
        return bad("its directory is not where its end record says");
    }

    Result<ZipEntry> read_entry(Reader& reader) {
        ZipEntry entry;
        SPLAT_ASSIGN(const Bytes head, reader.take(kDirectoryEntryBytes, "entry"));
        const std::byte* at = head.data();
        if (number<std::uint32_t>(at) != kEntryMagic) return bad("a directory entry has no mark");
        const auto flags = number<std::uint16_t>(at + 8);
        entry.method = number<std::uint16_t>(at + 10);
        entry.crc = number<std::uint32_t>(at + 16);
        entry.packed_bytes = number<std::uint32_t>(at + 20);
        entry.bytes = number<std::uint32_t>(at + 24);
        std::uint64_t start = number<std::uint32_t>(at + 42);
        const auto part = number<std::uint16_t>(at + 34);
        SPLAT_ASSIGN(const Bytes name, reader.take(number<std::uint16_t>(at + 28), "name"));
        SPLAT_ASSIGN(const Bytes extra, reader.take(number<std::uint16_t>(at + 30), "extra field"));
        SPLAT_ASSIGN(const Bytes comment, reader.take(number<std::uint16_t>(at + 32), "comment"));
        static_cast<void>(comment);
        entry.name = as_text(name);
        SPLAT_TRY(widen(extra, entry, start));
        if ((flags & kEncrypted) != 0) return unsupported("'" + entry.name + "' is encrypted");
        if (part != 0 && part != kIn16) return unsupported("an archive of several parts");
        SPLAT_TRY(read_local(start, flags, entry));
        return entry;
    }

    /// Fields that are full of ones are in the zip64 extra field, in this order.
    Status widen(Bytes extra, ZipEntry& entry, std::uint64_t& start) const {
        Reader reader(extra, what_ + ": extra field of " + entry.name);
        while (reader.left() >= 4) {
            std::uint16_t kind = 0;
            std::uint16_t bytes = 0;
            SPLAT_TRY(reader.read(kind, "kind"));
            SPLAT_TRY(reader.read(bytes, "size"));
            SPLAT_ASSIGN(const Bytes data, reader.take(bytes, "data"));
            if (kind != kExtra64) continue;
            Reader wide(data, reader.what());
            for (std::uint64_t* field : {&entry.bytes, &entry.packed_bytes, &start})
                if (*field == kIn32) SPLAT_TRY(wide.read(*field, "zip64 field"));
            return {};
        }
        return {};
    }

    /// The local header before the data must agree with the directory.
    Status read_local(std::uint64_t start, std::uint16_t flags, ZipEntry& entry) {
        SPLAT_ASSIGN(const Buffer head, piece(start, kLocalBytes));
        const std::byte* at = head.data();
        const auto name_bytes = number<std::uint16_t>(at + 26);
        if (number<std::uint32_t>(at) != kLocalMagic || name_bytes != entry.name.size())
            return bad("'" + entry.name + "' is not where the directory says");
        SPLAT_ASSIGN(const Buffer name, piece(start + kLocalBytes, name_bytes));
        if (as_text(name) != entry.name || number<std::uint16_t>(at + 8) != entry.method)
            return bad("'" + entry.name + "' has another name or method in its own header");
        const auto packed = number<std::uint32_t>(at + 18);
        const auto bytes = number<std::uint32_t>(at + 22);
        const bool told = (flags & kSizesFollow) == 0 && packed != kIn32 && bytes != kIn32;
        if (told && (packed != entry.packed_bytes || bytes != entry.bytes))
            return bad("'" + entry.name + "' has other sizes in its own header");
        entry.start = start + kLocalBytes + name_bytes + number<std::uint16_t>(at + 28);
        const auto end = checked_add(entry.start, entry.packed_bytes);
        if (!end || *end > start_) return bad("'" + entry.name + "' reaches into the directory");
        extents_.push_back({start, *end});
        return {};
    }

    [[nodiscard]] Status check_sizes(const ZipEntry& entry) const {
        if (entry.method != kStored && entry.method != kDeflated)
            return unsupported(format("'%s' is compressed by method %u, expected 0 or 8",
                                      entry.name.c_str(), entry.method));
        const bool lies = entry.method == kStored
                              ? entry.bytes != entry.packed_bytes
                              : entry.bytes / kMaxDeflateRatio > entry.packed_bytes;
        if (!lies) return {};
        return bad(format("'%s': %llu bytes cannot come from %llu", entry.name.c_str(),
                          llu(entry.bytes), llu(entry.packed_bytes)));
    }

    Status check_overlaps() {
        std::ranges::sort(extents_,
                          [](const Extent& a, const Extent& b) { return a.start < b.start; });
        for (std::size_t i = 1; i < extents_.size(); ++i)
            if (extents_[i].start < extents_[i - 1].end) return bad("two of its entries overlap");
        return {};
    }

    const Source& source_;
    std::string what_;
    std::uint64_t count_ = 0;
    std::uint64_t bytes_ = 0;
    std::uint64_t start_ = 0;
    std::vector<Extent> extents_;
};

/// Fields shared by a local header and a directory entry.
void put_common(Buffer& to, const ZipMember& member) {
    constexpr std::uint16_t kVersion = 20;
    constexpr std::uint16_t kUtf8 = 1U << 11U;
    constexpr std::uint16_t kFirstOfJanuary1980 = 0x21;
    const auto bytes = static_cast<std::uint32_t>(member.head.size() + member.body.size());
    put(to, kVersion);
    put(to, kUtf8);
    put(to, kStored);
    put(to, std::uint16_t{0});
    put(to, kFirstOfJanuary1980);
    put(to, crc32_of(member.body, crc32_of(member.head)));
    put(to, bytes);
    put(to, bytes);
    put(to, static_cast<std::uint16_t>(member.name.size()));
    put(to, std::uint16_t{0});
}

}  // namespace

Result<Zip> Zip::open(const Source& source, const std::string& what, const DecodeLimits& limits) {
    Zip zip;
    zip.source_ = &source;
    zip.what_ = what;
    SPLAT_ASSIGN(zip.entries_, DirectoryReader(source, what).run(limits));
    for (std::size_t i = 0; i < zip.entries_.size(); ++i)
        if (!zip.places_.emplace(zip.entries_[i].name, i).second)
            return damaged("%s: '%s' appears twice", what.c_str(), zip.entries_[i].name.c_str());
    return zip;
}

const ZipEntry* Zip::find(const std::string& name) const {
    const auto place = places_.find(name);
    return place == places_.end() ? nullptr : &entries_[place->second];
}

Status Zip::read(const ZipEntry& entry, Buffer& to) const {
    to.resize(entry.bytes);
    if (entry.method == kStored) {
        SPLAT_TRY(source_->read(entry.start, to));
    } else {
        Buffer packed(entry.packed_bytes);
        SPLAT_TRY(source_->read(entry.start, packed));
        SPLAT_TRY(inflate_raw(packed, to, what_ + ": '" + entry.name + "'"));
    }
    if (const std::uint32_t crc = crc32_of(to); crc != entry.crc)
        return damaged("%s: '%s' has the CRC %08x, expected %08x; its data is damaged",
                       what_.c_str(), entry.name.c_str(), crc, entry.crc);
    return {};
}

Result<FilePieces> write_zip(std::vector<ZipMember> members) {
    FilePieces file;
    Buffer directory;
    const Status too_large = splat::unsupported(
        "zip: 4 GiB, 65535 files or a name of 64 KiB are too much; "
        "safetensors files have no such limit");
    if (members.size() >= kIn16) return too_large;
    std::uint64_t start = 0;
    for (ZipMember& member : members) {
        const std::uint64_t next =
            start + kLocalBytes + member.name.size() + member.head.size() + member.body.size();
        if (next >= kIn32 || member.name.size() >= kIn16) return too_large;
        Buffer common;
        put_common(common, member);
        Buffer local;
        put(local, kLocalMagic);
        put_bytes(local, common);
        put_text(local, member.name);
        put(directory, kEntryMagic);
        put(directory, std::uint16_t{20});  // made by
        put_bytes(directory, common);
        directory.resize(directory.size() + 10);  // no comment, disk 0, no attributes
        put(directory, static_cast<std::uint32_t>(start));
        put_text(directory, member.name);
        file.add(std::move(local));
        file.add(std::move(member.head));
        file.add_view(member.body);
        start = next;
    }
    if (start + directory.size() >= kIn32) return too_large;
    const auto bytes = static_cast<std::uint32_t>(directory.size());
    put(directory, kEndMagic);
    put(directory, std::uint32_t{0});
    put(directory, static_cast<std::uint16_t>(members.size()));
    put(directory, static_cast<std::uint16_t>(members.size()));
    put(directory, bytes);
    put(directory, static_cast<std::uint32_t>(start));
    put(directory, std::uint16_t{0});
    file.add(std::move(directory));
    return file;
}

}  // namespace splat::io
