#pragma once

#include <cstdint>
#include <string>

#include "core/status.h"
#include "io/file.h"

namespace splat::io {

/// Deflate packs at most 1032 : 1 (zlib's documentation).
inline constexpr std::uint64_t kMaxDeflateRatio = 1032;

/// The bytes start as a gzip stream does.
bool is_gzip(Bytes bytes);

/// At most the first `count` bytes that a gzip stream holds; fewer if it ends or is damaged.
Buffer gunzip_head(Bytes packed, std::size_t count);

/// What a gzip stream has besides the bytes that were asked for.
struct GzipRest {
    bool inside = false;     ///< more data follow inside; the checksum is not known
    std::size_t behind = 0;  ///< packed bytes after its end
};

/// All of a gzip stream, which must hold `bytes` bytes and take all of `packed`; `what` names it in messages. Where
/// there is more, `rest` says so, unless it is null. Errors: kFormat if it is damaged, truncated or of
/// another length, before any allocation if the packed bytes are too few.
Result<Buffer> gunzip(Bytes packed, std::uint64_t bytes, const std::string& what,
                      GzipRest* rest = nullptr);

/// The same for zstd frames, without a rest.
Result<Buffer> unzstd(Bytes packed, std::uint64_t bytes, const std::string& what);

/// A bare deflate stream, which must fill `out` and take all of `packed`. Errors: as gunzip().
Status inflate_raw(Bytes packed, std::span<std::byte> out, const std::string& what);

/// CRC-32 of zip and gzip: of `bytes` appended to bytes whose CRC is `before`.
std::uint32_t crc32_of(Bytes bytes, std::uint32_t before = 0);

/// Packs what is put into it, and puts that into another sink. Errors of put(): the other sink's, kOutOfHostMemory.
class GzipSink : public ByteSink {
  public:
    explicit GzipSink(ByteSink& to);
    ~GzipSink() override;

    Status put(Bytes bytes) override;
    /// Put the end of the stream; call it once, last.
    Status finish();

  private:
    Status pack(Bytes bytes, int flush);

    struct Stream;
    std::unique_ptr<Stream> stream_;
    ByteSink& to_;
};

/// Errors: kOutOfHostMemory.
Result<Buffer> gzip(Bytes bytes);
Result<Buffer> zstd(Bytes bytes);

}  // namespace splat::io
