#pragma once

#include "fuzz/checksums.h"

namespace splat::fuzz {

inline constexpr std::string_view kGlbMark = "glTF";

/// Makes the lengths of a .glb right: of the file, of its JSON where that is too long, and of the bytes after it.
inline void repair_glb(std::span<std::byte> file) {
    constexpr std::size_t kHeader = 12, kChunk = 8;
    if (file.size() < kHeader + kChunk || !io::as_text(file).starts_with(kGlbMark)) return;
    const auto put = [file](std::size_t at, std::size_t value) {
        put_number(file, at, static_cast<std::uint32_t>(value), std::endian::little);
    };
    put(8, file.size());
    const std::size_t left = (file.size() - kHeader - kChunk) / 4 * 4;
    std::size_t json = number_at(file, kHeader, std::endian::little) / 4 * 4;
    json = json > left ? left : json;
    put(kHeader, json);
    const std::size_t next = kHeader + kChunk + json;
    if (file.size() - next >= kChunk) put(next, (file.size() - next - kChunk) / 4 * 4);
}

}  // namespace splat::fuzz
