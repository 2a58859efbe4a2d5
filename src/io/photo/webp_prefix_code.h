#pragma once

#include <array>

#include "io/bytes.h"

namespace splat::io {

/// Bits from the lowest of each byte on. Those behind the end are 0.
class BitReader {
  public:
    BitReader(Bytes bytes, std::uint64_t at) : bytes_(bytes), at_(at) {}

    /// At most 24 bits.
    std::uint32_t read(std::uint32_t count) {
        const std::uint32_t value = peek() & ((1U << count) - 1);
        at_ += count;
        return value;
    }

    /// At least 24 bits.
    [[nodiscard]] std::uint32_t peek() const {
        const std::uint64_t byte = at_ / 8;
        std::uint64_t word = 0;
        if (byte + sizeof word <= bytes_.size())
            std::memcpy(&word, &bytes_[byte], sizeof word);
        else if (byte < bytes_.size())
            std::memcpy(&word, &bytes_[byte], bytes_.size() - byte);
        return static_cast<std::uint32_t>(word >> at_ % 8);
    }

    void skip(std::uint32_t count) { at_ += count; }

    [[nodiscard]] std::uint64_t at() const { return at_; }

    /// True behind the end, and behind the first 8 bytes: libwebp notices no earlier end.
    [[nodiscard]] bool past_end() const {
        return at_ > 8 * std::max<std::uint64_t>(bytes_.size(), 8);
    }

  private:
    Bytes bytes_;
    std::uint64_t at_;
};

/// A canonical prefix code of lossless WebP. One symbol alone takes no bits. Source: RFC 9649, section 3.7.2.1.
class PrefixCode {
  public:
    static constexpr std::uint32_t kMostSymbols = 256 + 24 + 2048;
    static constexpr std::uint32_t kMostBits = 15;  ///< bits of the longest code

    /// Reads the code of an alphabet of `symbols`. False if it is not complete, or the stream ends.
    [[nodiscard]] bool read_code(BitReader& bits, std::uint32_t symbols);

    [[nodiscard]] bool takes_bits() const { return used_ != 1; }

    /// Reads a symbol.
    std::uint32_t read(BitReader& bits) const;

  private:
    bool read_coded_lengths(BitReader& bits, std::span<std::uint8_t> lengths);
    bool assign(std::span<const std::uint8_t> lengths);

    std::array<std::uint16_t, kMostBits + 1> counts_{};  ///< symbols of each length
    std::array<std::uint16_t, kMostSymbols> symbols_{};  ///< by length, then by number
    std::uint32_t used_ = 0;
};

}  // namespace splat::io
