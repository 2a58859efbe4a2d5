#include "io/photo/webp.h"

#include <webp/decode.h>

#include "io/photo/webp_lossless.h"

namespace splat::io {
namespace {

enum StreamFormat { kUnknown, kLossy, kLossless };  ///< values of WebPBitstreamFeatures::format

/// Where libwebp finds the pixels: `pixels` from the chunk VP8 or VP8L to the end of the file, `alpha` in the last
/// chunk ALPH before it. Both are empty if the file is not as RFC 9649, section 2, says: libwebp reads bare bit
/// streams, too.
struct Streams {
    Bytes pixels, alpha;
};

Streams find_streams(Bytes file) {
    constexpr std::size_t kRiffBytes = 12;
    constexpr std::size_t kChunkBytes = 8;  ///< tag and size
    if (!as_text(file).starts_with("RIFF")) return {};
    Streams streams;
    for (std::size_t at = kRiffBytes; at + kChunkBytes <= file.size();) {
        const std::string_view tag = as_text(file.subspan(at, 4));
        const std::size_t size = number<std::uint32_t>(&file[at + 4]);
        const Bytes data = file.subspan(at + kChunkBytes);
        if (tag == "VP8 " || tag == "VP8L") {
            streams.pixels = data;
            return streams;
        }
        if ((at == kRiffBytes && tag != "VP8X") || size > data.size()) return {};
        if (tag == "ALPH") streams.alpha = data.first(size);
        at += kChunkBytes + size + size % 2;
    }
    return {};
}

/// Takes what libwebp keeps while it decodes a lossless image or the alpha of a lossy one: the codes, and four bytes
/// for each pixel, but one for alpha that is a palette's. Alpha goes into a plane, too (libwebp 1.2 allocates a
/// second one, and never touches it).
Status take_streams(const Streams& streams, const Image& image, StreamFormat format,
                    DecodeBudget& budget) {
    constexpr std::uint64_t kVp8lHeaderBits = 40;
    constexpr std::uint64_t kAlphaHeaderBits = 8;
    constexpr std::uint64_t kRowsAtOnce = 17;  ///< before they are written
    if (streams.pixels.empty())
        return error(Code::kFormat, "webp: the file has no image, or is truncated");
    const bool lossless = format == kLossless;
    const Bytes stream = lossless ? streams.pixels : streams.alpha;
    const std::string what =
        splat::format("webp: %u x %u pixels while they are decoded", image.width, image.height);
    if (!lossless) {
        if (stream.empty()) return {};
        SPLAT_TRY(budget.take(image.height, image.width, what));
        const bool compressed = (std::to_integer<unsigned>(stream[0]) & 3U) == 1;
        if (!compressed) return {};
    }
    SPLAT_ASSIGN(const LosslessHead head,
                 read_lossless_head(stream, lossless ? kVp8lHeaderBits : kAlphaHeaderBits,
                                    image.width, image.height, budget));
    const std::uint64_t pixels = std::uint64_t{image.height} * head.width;
    const bool bytes = !lossless && head.only_palette && head.only_green && head.cache_bits == 0;
    return bytes ? budget.take(pixels, 1, what)
                 : budget.take(pixels + kRowsAtOnce * image.width, 4, what);
}

}  // namespace

Result<Image> read_webp(Bytes file, const ImageOptions& options) {
    const auto* const data = reinterpret_cast<const std::uint8_t*>(file.data());
    WebPBitstreamFeatures features;
    const VP8StatusCode status = WebPGetFeatures(data, file.size(), &features);
    if (status != VP8_STATUS_OK)
        return error(Code::kFormat, "webp: %s",
                     status == VP8_STATUS_NOT_ENOUGH_DATA
                         ? "the file is truncated"
                         : "the file does not start like a WebP file");
    if (features.has_animation != 0)
        return error(Code::kUnsupported, "webp: an animation, expected one image");
    Image image;
    image.width = static_cast<std::uint32_t>(features.width);
    image.height = static_cast<std::uint32_t>(features.height);
    image.channels = features.has_alpha != 0 ? 4 : 3;
    SPLAT_TRY(check_header(image, options, 0, file.size(), "webp"));
    DecodeBudget budget(file.size(), options.limits);
    const std::uint64_t samples = std::uint64_t{image.width} * image.height * image.channels;
    SPLAT_TRY(budget.take(samples, sizeof image.samples[0], "webp: pixels"));
    SPLAT_TRY(take_streams(find_streams(file), image, static_cast<StreamFormat>(features.format),
                           budget));
    if (options.header_only) return image;
    std::uint8_t* const rows = make_byte_samples(image);
    const int stride = static_cast<int>(image.width * image.channels);
    const auto* const decoded = (image.channels == 4 ? WebPDecodeRGBAInto : WebPDecodeRGBInto)(
        data, file.size(), rows, image.samples.size(), stride);
    if (decoded == nullptr) return error(Code::kFormat, "webp: the file is damaged or truncated");
    spread_byte_samples(image);
    return image;
}

}  // namespace splat::io
