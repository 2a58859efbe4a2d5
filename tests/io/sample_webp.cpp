#include "io/sample_webp.h"

namespace splat::test {

using io::Buffer;
using io::Bytes;

void BitWriter::put(std::uint32_t value, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i, ++count_) {
        if (count_ % 8 == 0) bytes_.push_back(std::byte{0});
        bytes_.back() |= static_cast<std::byte>((value >> i & 1U) << count_ % 8);
    }
}

void BitWriter::put_single(std::uint32_t symbol) {
    put(1, 2);  // simple, of one symbol
    put(1, 1);  // 8 bits long
    put(symbol, 8);
}

void put_vp8l_header(BitWriter& to, std::uint32_t width, std::uint32_t height) {
    to.put(0x2F, 8);
    to.put(width - 1, 14);
    to.put(height - 1, 14);
    to.put(0, 1 + 3);  // no alpha; version
}

namespace {

/// The code of the first 2^bits symbols, of 8 or 11 bits each: those of a symbol, the highest first. `all`: there are
/// no other symbols.
void put_equal_code(BitWriter& to, std::uint32_t bits, bool all) {
    const std::uint32_t lengths = bits + 4;  // 17, 18, 0, 1, 2, 3, 4, 5, 16, 6, 7, 8, 9, 10, 11
    to.put(0, 1);
    to.put(lengths - 4, 4);
    for (std::uint32_t i = 1; i < lengths; ++i) to.put(0, 3);
    to.put(1, 3);  // the one length that occurs: it takes no bits
    to.put(all ? 0 : 1, 1);
    if (all) return;
    const std::uint32_t half = bits / 2 - (bits == 8 ? 1 : 0);
    to.put(half, 3);  // a number of 2 + 2 x half bits follows
    to.put((1U << bits) - 2, 2 + 2 * half);
}

void put_byte(BitWriter& to, std::uint32_t value) {
    for (int i = 7; i >= 0; --i) to.put(value >> i & 1U, 1);
}

}  // namespace

void put_vp8l_groups(BitWriter& to, std::uint32_t columns, std::uint32_t rows, Codes codes) {
    constexpr std::uint32_t kMostBits =
        11;  // A colour cache of 2^11 symbols, which green has, too.
    const bool large = codes == Codes::kLarge;
    to.put(0, 1);  // no transform
    to.put(large ? 1 : 0, 1);
    if (large) to.put(kMostBits, 4);
    to.put(1, 1);  // an entropy image of blocks of 2^2 pixels
    to.put(0, 3);
    to.put(0, 1);
    put_equal_code(to, 8, false);
    put_equal_code(to, 8, true);
    for (int code = 2; code < 5; ++code) to.put_single(0);
    for (std::uint32_t group = 0; group < columns * rows; ++group) {
        put_byte(to, group & 0xFFU);
        put_byte(to, group >> 8U);
    }
    for (std::uint32_t code = 0; code < 5 * columns * rows; ++code) {
        if (large && code % 5 == 0)
            put_equal_code(to, kMostBits, false);
        else
            to.put(1, 4);  // 0 alone
    }
    if (!large) return;
    for (std::uint32_t pixel = 0; pixel < 16 * columns * rows; ++pixel) to.put(0, kMostBits);
}

Buffer sample_webp(const std::vector<std::pair<std::string_view, Bytes>>& chunks) {
    Buffer body;
    io::put_text(body, "WEBP");
    for (const auto& [tag, data] : chunks) {
        io::put_text(body, tag);
        io::put(body, static_cast<std::uint32_t>(data.size()));
        io::put_bytes(body, data);
        body.resize(body.size() + data.size() % 2);
    }
    Buffer file;
    io::put_text(file, "RIFF");
    io::put(file, static_cast<std::uint32_t>(body.size()));
    io::put_bytes(file, body);
    return file;
}

Buffer sample_webp_groups(std::uint32_t columns, std::uint32_t rows, Codes codes) {
    BitWriter stream;
    put_vp8l_header(stream, 4 * columns, 4 * rows);
    put_vp8l_groups(stream, columns, rows, codes);
    return sample_webp({{"VP8L", stream.bytes()}});
}

Buffer sample_webp_of_many_pixels() {
    std::uint64_t bits = 0x2F;
    std::uint32_t count = 8;
    const auto add = [&](std::uint64_t value, std::uint32_t width) {
        bits |= value << count;
        count += width;
    };
    add(16382, 14);
    add(16382, 14);
    add(0, 1 + 3 + 3);                               // alpha, version; transform, cache, groups
    for (int code = 0; code < 5; ++code) add(1, 4);  // simple, of one symbol of one bit: 0
    Buffer file;
    io::put_text(file, "RIFF");
    io::put(file, std::uint32_t{24});
    io::put_text(file, "WEBPVP8L");
    io::put(file, std::uint32_t{12});
    io::put(file, bits);
    io::put(file, std::uint32_t{0});
    return file;
}

Buffer with_webp_alpha(Bytes lossy, std::uint32_t width, std::uint32_t height, Bytes alpha) {
    Buffer header;
    io::put(header, std::uint32_t{16});  // there is alpha
    for (const std::uint32_t side : {width - 1, height - 1})
        for (const unsigned shift : {0U, 8U, 16U})
            header.push_back(static_cast<std::byte>(side >> shift));
    return sample_webp({{"VP8X", header}, {"ALPH", alpha}, {"VP8 ", lossy.subspan(20)}});
}

}  // namespace splat::test
