// Base64 (RFC 4648), in which data URIs have the bytes of a document that is one file of text.

#include <array>

#include "core/shown.h"
#include "io/scenes/gltf.h"

namespace splat::io::gltf {
namespace {

constexpr std::string_view kDigits =
    "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr std::uint8_t kNoDigit = 64;

constexpr std::array<std::uint8_t, 256> kValues = [] {
    std::array<std::uint8_t, 256> values{};
    values.fill(kNoDigit);
    for (std::size_t i = 0; i < kDigits.size(); ++i)
        values[static_cast<unsigned char>(kDigits[i])] = static_cast<std::uint8_t>(i);
    return values;
}();

}  // namespace

Result<Buffer> from_base64(std::string_view text, const std::string& where) {
    for (int i = 0; i < 2 && text.ends_with('='); ++i) text.remove_suffix(1);
    if (text.size() % 4 == 1)
        return damaged("gltf: %s: %zu characters of base64, which hold no whole bytes",
                       where.c_str(), text.size());
    Buffer bytes(text.size() / 4 * 3 + text.size() % 4 * 3 / 4);
    std::uint32_t bits = 0;
    std::size_t written = 0;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const std::uint8_t value = kValues[static_cast<unsigned char>(text[i])];
        if (value == kNoDigit)
            return damaged("gltf: %s: character %zu of its base64 is '%s'", where.c_str(), i,
                           shown(text.substr(i, 1)).c_str());
        bits = bits << 6U | value;
        // After the first character of four, each one completes a byte.
        if (i % 4 != 0) bytes[written++] = static_cast<std::byte>(bits >> (2 * (3 - i % 4)) & 255U);
    }
    return bytes;
}

void put_base64(Buffer& to, Bytes bytes) {
    std::size_t at = to.size();
    to.resize(at + (bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t there = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t bits = 0;
        for (std::size_t k = 0; k < 3; ++k)
            bits = bits << 8U | (k < there ? std::to_integer<std::uint32_t>(bytes[i + k]) : 0);
        for (std::size_t k = 0; k < 4; ++k)
            to[at++] =
                static_cast<std::byte>(k <= there ? kDigits[bits >> (6 * (3 - k)) & 63U] : '=');
    }
}

}  // namespace splat::io::gltf
