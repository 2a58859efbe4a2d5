#pragma once

#include "fuzz/target.h"
#include "io/compress.h"

extern "C" std::size_t LLVMFuzzerMutate(std::uint8_t* data, std::size_t size, std::size_t max_size);

namespace splat::fuzz {

inline std::uint32_t number_at(std::span<const std::byte> file, std::size_t at, std::endian order) {
    return io::number<std::uint32_t>(file.data() + at, order);
}

inline void put_number(std::span<std::byte> file, std::size_t at, std::uint32_t value,
                       std::endian order) {
    io::Buffer bytes;
    io::put(bytes, value, order);
    std::copy(bytes.begin(), bytes.end(), file.begin() + static_cast<std::ptrdiff_t>(at));
}

/// Repairs each chunk of a PNG file: length, type, data, CRC-32 of type and data.
inline void repair_png(std::span<std::byte> file) {
    for (std::size_t at = 8; at + 12 <= file.size();) {
        const std::size_t length = number_at(file, at, std::endian::big);
        if (length > file.size() - at - 12) return;
        put_number(file, at + 8 + length, io::crc32_of(file.subspan(at + 4, length + 4)),
                   std::endian::big);
        at += length + 12;
    }
}

/// Repairs each stored file of an archive, in the directory ("PK 1 2") and before the file.
inline void repair_zip(std::span<std::byte> file) {
    constexpr std::uint32_t kEntry = 0x02014B50;
    constexpr std::size_t kEntryBytes = 46, kLocalBytes = 30;
    const auto word = [&file](std::size_t at) { return number_at(file, at, std::endian::little); };
    const auto half = [&file](std::size_t at) { return io::number<std::uint16_t>(&file[at]); };
    for (std::size_t at = 0; at + kEntryBytes <= file.size(); ++at) {
        if (word(at) != kEntry || half(at + 10) != 0) continue;
        const std::size_t bytes = word(at + 20), local = word(at + 42);
        if (local > file.size() || file.size() - local < kLocalBytes) continue;
        const std::size_t start = local + kLocalBytes + half(local + 26) + half(local + 28);
        if (start > file.size() || bytes > file.size() - start) continue;
        const std::uint32_t crc = io::crc32_of(file.subspan(start, bytes));
        put_number(file, at + 16, crc, std::endian::little);
        put_number(file, local + 14, crc, std::endian::little);
    }
}

}  // namespace splat::fuzz

/// Mutates as libFuzzer does, then makes the checksums right, in all but every eighth input: a parser that compares
/// them would refuse all others.
#define SPLAT_FUZZ_MUTATOR(repair)                                                        \
    extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,  \
                                                   std::size_t max_size, unsigned seed);  \
    extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size,  \
                                                   std::size_t max_size, unsigned seed) { \
        size = LLVMFuzzerMutate(data, size, max_size);                                    \
        if (seed % 8 != 0) repair(std::as_writable_bytes(std::span(data, size)));         \
        return size;                                                                      \
    }
