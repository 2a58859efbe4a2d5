#include "io/animation.h"

#include "io/compress.h"

namespace splat::io {
namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1A\n";

template <class T>
void put_big(Buffer& to, T value) {
    put(to, value, std::endian::big);
}

/// Length, type, data, CRC of type and data.
void put_chunk(Buffer& to, std::string_view type, Bytes data) {
    put_big(to, static_cast<std::uint32_t>(data.size()));
    const std::size_t start = to.size();
    put_text(to, type);
    put_bytes(to, data);
    put_big(to, crc32_of(Bytes(to).subspan(start)));
}

/// The packed pixels of a PNG file of our own.
Buffer packed_pixels(const Buffer& png) {
    Buffer packed;
    for (std::size_t at = kPngSignature.size(); at < png.size();) {
        const std::size_t size = number<std::uint32_t>(&png[at], std::endian::big);
        if (as_text(Bytes(png).subspan(at + 4, 4)) == "IDAT")
            put_bytes(packed, Bytes(png).subspan(at + 8, size));
        at += 12 + size;
    }
    return packed;
}

Buffer frame_control(const Image& image, std::uint32_t sequence, std::uint32_t milliseconds) {
    Buffer data;
    data.reserve(26);  // all of it
    for (const std::uint32_t value : {sequence, image.width, image.height, 0U, 0U})
        put_big(data, value);
    put_big(data, static_cast<std::uint16_t>(milliseconds));
    put_big(data, std::uint16_t{1000});
    put_big(data, std::uint16_t{0});  // dispose: leave; blend: replace
    return data;
}

}  // namespace

Status check_frames(const std::vector<Image>& frames, const AnimationOptions& options) {
    if (frames.empty()) return invalid("animation: there is no frame");
    if (options.milliseconds < 1 || options.milliseconds > 65535)
        return invalid("animation: %u ms for a frame, expected 1 to 65535", options.milliseconds);
    for (const Image& frame : frames) {
        SPLAT_TRY(check_image(frame));
        if (frame.bits != 8 || frame.width != frames[0].width || frame.height != frames[0].height ||
            frame.channels != frames[0].channels)
            return invalid(
                "animation: a frame of %u x %u x %u of %u bits after one of %u x %u x %u, expected "
                "the same and 8 bits",
                frame.width, frame.height, frame.channels, frame.bits, frames[0].width,
                frames[0].height, frames[0].channels);
    }
    return {};
}

Result<Buffer> write_apng(const std::vector<Image>& frames, const AnimationOptions& options) {
    SPLAT_TRY(check_frames(frames, options));
    constexpr std::size_t kHeaderBytes = 25;  ///< bytes of the chunk IHDR
    Buffer file;
    Buffer control;
    put_big(control, static_cast<std::uint32_t>(frames.size()));
    put_big(control, options.repeats);
    std::uint32_t sequence = 0;
    for (const Image& frame : frames) {
        SPLAT_ASSIGN(const Buffer png, write_png(frame));
        const bool first = file.empty();
        if (first) {
            put_bytes(file, Bytes(png).first(kPngSignature.size() + kHeaderBytes));
            put_chunk(file, "acTL", control);
        }
        put_chunk(file, "fcTL", frame_control(frame, sequence++, options.milliseconds));
        Buffer data;
        if (!first) put_big(data, sequence++);
        put_bytes(data, packed_pixels(png));
        put_chunk(file, first ? "IDAT" : "fdAT", data);
    }
    put_chunk(file, "IEND", {});
    return file;
}

}  // namespace splat::io
