#include "io/apng.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdlib>

#include "io/compress.h"

namespace splat::io {
namespace {

using PixelRow = std::vector<std::uint8_t>;

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
    const uLong crc =
        crc32_z(0, reinterpret_cast<const Bytef*>(to.data() + start), to.size() - start);
    put_big(to, static_cast<std::uint32_t>(crc));
}

std::uint8_t paeth(int left, int above, int corner) {
    const int guess = left + above - corner;
    const int to_left = std::abs(guess - left);
    const int to_above = std::abs(guess - above);
    const int to_corner = std::abs(guess - corner);
    if (to_left <= to_above && to_left <= to_corner) return static_cast<std::uint8_t>(left);
    return static_cast<std::uint8_t>(to_above <= to_corner ? above : corner);
}

/// PNG's filters 0 none, 1 left, 2 above, 3 average, 4 Paeth.
void filter(int type, const PixelRow& row, const PixelRow& above, std::size_t pixel,
            PixelRow& out) {
    for (std::size_t i = 0; i < row.size(); ++i) {
        const int left = i < pixel ? 0 : row[i - pixel];
        const int up = above[i];
        const int corner = i < pixel ? 0 : above[i - pixel];
        const int guesses[] = {0, left, up, (left + up) / 2, paeth(left, up, corner)};
        out[i] = static_cast<std::uint8_t>(row[i] - guesses[type]);
    }
}

/// The usual heuristic for the smallest file: the least sum of absolute values.
std::uint64_t cost(const PixelRow& filtered) {
    std::uint64_t sum = 0;
    for (const std::uint8_t value : filtered)
        sum += static_cast<std::uint64_t>(std::abs(static_cast<std::int8_t>(value)));
    return sum;
}

/// Rows with their filters, before compression.
Buffer filtered_rows(const Image& image) {
    const std::size_t width = std::size_t{image.width} * image.channels;
    Buffer out;
    out.reserve((width + 1) * image.height);
    PixelRow above(width);
    PixelRow row(width);
    std::array<PixelRow, 5> candidates;
    candidates.fill(PixelRow(width));
    for (std::size_t y = 0; y < image.height; ++y) {
        for (std::size_t i = 0; i < width; ++i)
            row[i] = static_cast<std::uint8_t>(image.samples[y * width + i]);
        std::size_t best = 0;
        for (std::size_t type = 0; type < candidates.size(); ++type) {
            filter(static_cast<int>(type), row, above, image.channels, candidates[type]);
            if (cost(candidates[type]) < cost(candidates[best])) best = type;
        }
        put(out, static_cast<std::uint8_t>(best));
        put_bytes(out, std::as_bytes(std::span(candidates[best])));
        std::swap(above, row);
    }
    return out;
}

Buffer image_header(const Image& image) {
    constexpr std::uint8_t kTypes[] = {0, 4, 2, 6};
    Buffer data;
    put_big(data, image.width);
    put_big(data, image.height);
    for (const int byte : {8, int{kTypes[image.channels - 1]}, 0, 0, 0})
        put(data, static_cast<std::uint8_t>(byte));
    return data;
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
    if (frames.empty()) return error(Code::kInvalidArgument, "animation: there is no frame");
    if (options.milliseconds < 1 || options.milliseconds > 65535)
        return error(Code::kInvalidArgument, "animation: %u ms for a frame, expected 1 to 65535",
                     options.milliseconds);
    for (const Image& frame : frames) {
        SPLAT_TRY(check_image(frame));
        if (frame.bits != 8 || frame.width != frames[0].width || frame.height != frames[0].height ||
            frame.channels != frames[0].channels)
            return error(
                Code::kInvalidArgument,
                "animation: a frame of %u x %u x %u of %u bits after one of %u x %u x %u, expected "
                "the same and 8 bits",
                frame.width, frame.height, frame.channels, frame.bits, frames[0].width,
                frames[0].height, frames[0].channels);
    }
    return {};
}

Result<Buffer> write_apng(const std::vector<Image>& frames, const AnimationOptions& options) {
    SPLAT_TRY(check_frames(frames, options));
    Buffer file;
    put_text(file, "\x89PNG\r\n\x1A\n");
    put_chunk(file, "IHDR", image_header(frames[0]));
    Buffer control;
    put_big(control, static_cast<std::uint32_t>(frames.size()));
    put_big(control, options.repeats);
    put_chunk(file, "acTL", control);
    std::uint32_t sequence = 0;
    for (std::size_t i = 0; i < frames.size(); ++i) {
        put_chunk(file, "fcTL", frame_control(frames[i], sequence++, options.milliseconds));
        SPLAT_ASSIGN(const Buffer packed, deflate_zlib(filtered_rows(frames[i])));
        if (i == 0) {
            put_chunk(file, "IDAT", packed);
            continue;
        }
        Buffer data;
        put_big(data, sequence++);
        put_bytes(data, packed);
        put_chunk(file, "fdAT", data);
    }
    put_chunk(file, "IEND", {});
    return file;
}

}  // namespace splat::io
