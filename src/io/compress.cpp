#include "io/compress.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>

namespace splat::io {
namespace {

/// A zstd block of 4 bytes has at most 128 KiB.
constexpr std::uint64_t kMaxZstdRatio = 1U << 15U;

/// zlib counts in 32 bits.
constexpr std::size_t kMaxPiece = std::size_t{1} << 30U;

constexpr int kGzipWindow = MAX_WBITS + 16;
constexpr int kRawWindow = -MAX_WBITS;

Status check_ratio(Bytes packed, std::uint64_t bytes, std::uint64_t ratio,
                   const std::string& what) {
    if (bytes / ratio <= packed.size()) return {};
    return damaged("%s: %llu bytes cannot come from %zu compressed ones", what.c_str(), llu(bytes),
                   packed.size());
}

class Inflater : NoCopy {
  public:
    explicit Inflater(Bytes packed, int window = kGzipWindow) : packed_(packed) {
        started_ = inflateInit2(&stream_, window) == Z_OK;
    }
    ~Inflater() {
        if (started_) inflateEnd(&stream_);
    }

    /// Fills as much of `out` as there is; returns how much.
    std::size_t fill(std::span<std::byte> out) {
        std::size_t filled = 0;
        while (started_ && !ended_ && filled < out.size()) {
            const std::size_t piece = std::min(out.size() - filled, kMaxPiece);
            const std::size_t got = step(out.data() + filled, piece);
            if (got == 0 && !ended_) break;
            filled += got;
        }
        return filled;
    }

    /// The stream has ended, and its checksum is right.
    bool at_end() {
        std::byte none{};
        if (started_ && !ended_) static_cast<void>(step(&none, 0));
        return ended_;
    }

    /// Compressed bytes that were read.
    [[nodiscard]] std::size_t used() const { return used_; }

  private:
    std::size_t step(std::byte* out, std::size_t count) {
        const std::size_t fresh = std::min(packed_.size() - used_, kMaxPiece);
        stream_.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(packed_.data() + used_));
        stream_.avail_in = static_cast<uInt>(fresh);
        stream_.next_out = reinterpret_cast<Bytef*>(out);
        stream_.avail_out = static_cast<uInt>(count);
        const int result = inflate(&stream_, Z_NO_FLUSH);
        used_ += fresh - stream_.avail_in;
        ended_ = result == Z_STREAM_END;
        return count - stream_.avail_out;
    }

    z_stream stream_{};
    Bytes packed_;
    std::size_t used_ = 0;
    bool started_ = false;
    bool ended_ = false;
};

}  // namespace

bool is_gzip(Bytes bytes) {
    return bytes.size() >= 2 && bytes[0] == std::byte{0x1F} && bytes[1] == std::byte{0x8B};
}

Buffer gunzip_head(Bytes packed, std::size_t count) {
    Buffer head(count);
    head.resize(Inflater(packed).fill(head));
    return head;
}

Result<Buffer> gunzip(Bytes packed, std::uint64_t bytes, const std::string& what, GzipRest* rest) {
    SPLAT_TRY(check_ratio(packed, bytes, kMaxDeflateRatio, what));
    Buffer out(bytes);
    Inflater inflater(packed);
    const std::size_t filled = inflater.fill(out);
    if (filled < bytes)
        return damaged("%s: the gzip data is damaged or truncated after %zu of %llu bytes",
                       what.c_str(), filled, llu(bytes));
    GzipRest found;
    if (inflater.at_end()) {
        found.behind = packed.size() - inflater.used();
    } else {
        std::byte next{};
        found.inside = inflater.fill({&next, 1}) == 1;
    }
    if (!inflater.at_end() && !(found.inside && rest != nullptr))
        return damaged("%s: the gzip data does not end after %llu bytes, or its checksum is wrong",
                       what.c_str(), llu(bytes));
    if (found.behind != 0 && rest == nullptr)
        return damaged("%s: %zu bytes after the gzip data", what.c_str(), found.behind);
    if (rest != nullptr) *rest = found;
    return out;
}

Status inflate_raw(Bytes packed, std::span<std::byte> out, const std::string& what) {
    Inflater inflater(packed, kRawWindow);
    const std::size_t filled = inflater.fill(out);
    if (filled < out.size())
        return damaged("%s: the deflate data is damaged or truncated after %zu of %zu bytes",
                       what.c_str(), filled, out.size());
    if (!inflater.at_end() || inflater.used() != packed.size())
        return damaged("%s: the deflate data does not end after %zu bytes", what.c_str(),
                       out.size());
    return {};
}

std::uint32_t crc32_of(Bytes bytes, std::uint32_t before) {
    if (bytes.empty()) return before;  // zlib would return the initial CRC
    return static_cast<std::uint32_t>(
        crc32_z(before, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size()));
}

Result<Buffer> unzstd(Bytes packed, std::uint64_t bytes, const std::string& what) {
    SPLAT_TRY(check_ratio(packed, bytes, kMaxZstdRatio, what));
    const unsigned long long promised = ZSTD_getFrameContentSize(packed.data(), packed.size());
    if (promised == ZSTD_CONTENTSIZE_ERROR ||
        (promised != ZSTD_CONTENTSIZE_UNKNOWN && promised != bytes))
        return damaged("%s: not a zstd frame of %llu bytes", what.c_str(), llu(bytes));
    Buffer out(bytes);
    const std::size_t got = ZSTD_decompress(out.data(), out.size(), packed.data(), packed.size());
    if (ZSTD_isError(got) != 0)
        return damaged("%s: the zstd data is damaged: %s", what.c_str(), ZSTD_getErrorName(got));
    if (got != bytes)
        return damaged("%s: the zstd data holds %zu bytes, expected %llu", what.c_str(), got,
                       llu(bytes));
    return out;
}

struct GzipSink::Stream {
    z_stream z{};
    gz_header header{};
    Buffer piece = Buffer(std::size_t{1} << 18U);
    bool started = false;
};

GzipSink::GzipSink(ByteSink& to) : stream_(std::make_unique<Stream>()), to_(to) {
    stream_->started = deflateInit2(&stream_->z, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzipWindow, 8,
                                    Z_DEFAULT_STRATEGY) == Z_OK;
    if (!stream_->started) return;
    stream_->header.os = 3;  // Unix's (RFC 1952), so that files are the same from all systems
    deflateSetHeader(&stream_->z, &stream_->header);
}

GzipSink::~GzipSink() {
    if (stream_->started) deflateEnd(&stream_->z);
}

Status GzipSink::pack(Bytes bytes, int flush) {
    if (!stream_->started) return error(Code::kOutOfHostMemory, "zlib did not start");
    z_stream& z = stream_->z;
    Buffer& piece = stream_->piece;
    z.next_in = reinterpret_cast<Bytef*>(const_cast<std::byte*>(bytes.data()));
    z.avail_in = static_cast<uInt>(bytes.size());
    do {
        z.next_out = reinterpret_cast<Bytef*>(piece.data());
        z.avail_out = static_cast<uInt>(piece.size());
        static_cast<void>(deflate(&z, flush));
        SPLAT_TRY(to_.put(Bytes(piece).first(piece.size() - z.avail_out)));
    } while (z.avail_out == 0);
    return {};
}

Status GzipSink::put(Bytes bytes) {
    for (; !bytes.empty(); bytes = bytes.subspan(std::min(bytes.size(), kMaxPiece)))
        SPLAT_TRY(pack(bytes.first(std::min(bytes.size(), kMaxPiece)), Z_NO_FLUSH));
    return {};
}

Status GzipSink::finish() {
    return pack({}, Z_FINISH);
}

Result<Buffer> gzip(Bytes bytes) {
    BufferSink packed;
    GzipSink sink(packed);
    SPLAT_TRY(sink.put(bytes));
    SPLAT_TRY(sink.finish());
    return std::move(packed.file);
}

Result<Buffer> zstd(Bytes bytes) {
    constexpr int kLevel = 6;
    Buffer out(ZSTD_compressBound(bytes.size()));
    const std::size_t got =
        ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), kLevel);
    if (ZSTD_isError(got) != 0)
        return error(Code::kOutOfHostMemory, "zstd: %s", ZSTD_getErrorName(got));
    out.resize(got);
    return out;
}

}  // namespace splat::io
