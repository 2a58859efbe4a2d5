#include "io/photo/webp_prefix_code.h"

namespace splat::io {

/// The length of each symbol, 0 to 15.
bool PrefixCode::assign(std::span<const std::uint8_t> lengths) {
    counts_.fill(0);
    for (const std::uint8_t length : lengths) ++counts_[length];
    used_ = static_cast<std::uint32_t>(lengths.size()) - counts_[0];
    std::uint32_t sum = 0;
    std::array<std::uint16_t, kMostBits + 2> next{};  // place in symbols_ for each length
    for (std::uint32_t length = 1; length <= kMostBits; ++length) {
        sum += std::uint32_t{counts_[length]} << (kMostBits - length);
        next[length + 1] = static_cast<std::uint16_t>(next[length] + counts_[length]);
    }
    for (std::size_t i = 0; i < lengths.size(); ++i)
        if (lengths[i] != 0) symbols_[next[lengths[i]]++] = static_cast<std::uint16_t>(i);
    return used_ == 1 || sum == 1U << kMostBits;
}

std::uint32_t PrefixCode::read(BitReader& bits) const {
    if (!takes_bits()) return symbols_[0];
    const std::uint32_t ahead = bits.peek();
    std::uint32_t code = 0;   // the bits so far
    std::uint32_t first = 0;  // the first code of this length
    std::uint32_t index = 0;  // place of that code's symbol
    for (std::uint32_t length = 1; length <= kMostBits; ++length) {
        code = code << 1U | (ahead >> (length - 1) & 1U);
        first <<= 1U;
        if (code - first < counts_[length]) {
            bits.skip(length);
            return symbols_[index + code - first];
        }
        index += counts_[length];
        first += counts_[length];
    }
    return 0;  // not reached: the code is complete
}

/// Lengths that have a prefix code of their own. False if they are damaged.
bool PrefixCode::read_coded_lengths(BitReader& bits, std::span<std::uint8_t> lengths) {
    constexpr std::uint8_t kOrder[] = {17, 18, 0, 1,  2,  3,  4,  5,  16, 6,
                                       7,  8,  9, 10, 11, 12, 13, 14, 15};
    std::array<std::uint8_t, std::size(kOrder)> own{};
    const std::uint32_t count = 4 + bits.read(4);
    for (std::uint32_t i = 0; i < count; ++i)
        own[kOrder[i]] = static_cast<std::uint8_t>(bits.read(3));
    if (!assign(own)) return false;
    std::size_t reads = lengths.size();
    if (bits.read(1) == 1) {
        const std::uint32_t width = 2 + 2 * bits.read(3);
        reads = 2 + bits.read(width);
    }
    if (reads > lengths.size()) return false;
    std::uint8_t last = 8;
    for (std::size_t at = 0; at < lengths.size() && reads > 0; --reads) {
        const std::uint32_t symbol = read(bits);
        if (symbol < 16) {
            lengths[at++] = static_cast<std::uint8_t>(symbol);
            if (symbol != 0) last = static_cast<std::uint8_t>(symbol);
            continue;
        }
        const std::size_t repeat = symbol == 16   ? 3 + bits.read(2)
                                   : symbol == 17 ? 3 + bits.read(3)
                                                  : 11 + bits.read(7);
        if (repeat > lengths.size() - at) return false;
        std::fill_n(lengths.begin() + static_cast<std::ptrdiff_t>(at), repeat,
                    symbol == 16 ? last : std::uint8_t{0});
        at += repeat;
    }
    return true;
}

bool PrefixCode::read_code(BitReader& bits, std::uint32_t symbols) {
    std::array<std::uint8_t, kMostSymbols> storage;
    std::fill_n(storage.begin(), std::max(symbols, 256U), std::uint8_t{0});
    const std::span<std::uint8_t> lengths = std::span(storage).first(symbols);
    if (bits.read(1) == 1) {  // one or two symbols
        const std::uint32_t more = bits.read(1);
        const std::uint32_t width = bits.read(1) == 1 ? 8 : 1;
        storage[bits.read(width)] = 1;
        if (more == 1) storage[bits.read(8)] = 1;
    } else if (!read_coded_lengths(bits, lengths)) {
        return false;
    }
    return !bits.past_end() && assign(lengths);
}

}  // namespace splat::io
