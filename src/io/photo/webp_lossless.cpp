#include "io/photo/webp_lossless.h"

#include "io/photo/webp_prefix_code.h"

namespace splat::io {
namespace {

enum Transform : std::uint32_t { kPredictor, kCrossColor, kSubtractGreen, kPalette };

enum Part { kGreen, kRed, kBlue, kAlpha, kDistance, kParts };  ///< the codes of a group, in order

constexpr std::uint32_t kLiterals = 256;
constexpr std::uint32_t kLengths = 24;
constexpr std::uint32_t kMostCacheBits = 11;
static_assert(kLiterals + kLengths + (1U << kMostCacheBits) == PrefixCode::kMostSymbols);

/// The size of an alphabet.
constexpr std::uint32_t symbols_of(std::size_t part, std::uint32_t cache_bits) {
    if (part == kDistance) return 40;
    if (part != kGreen) return kLiterals;
    return kLiterals + kLengths + (cache_bits > 0 ? 1U << cache_bits : 0);
}

/// Bytes of a group in libwebp 1.2: five tables in an allocation for the worst case, and a struct of 568 bytes.
/// A table has entries of 4 bytes, 256 of them for the first 8 bits of a code. With those behind it there are at
/// most symbols + 376 for codes of up to 15 bits (the program "enough" of zlib gives 410 for 40 symbols, 630 for 256,
/// 654 for 280, 2704 for 2328). Measured: 11816 + 568 bytes without a cache.
constexpr std::uint64_t group_bytes(std::uint32_t cache_bits) {
    std::uint64_t entries = 0;
    for (std::size_t part = kGreen; part < kParts; ++part)
        entries += symbols_of(part, cache_bits) + 376;
    return 4 * entries + 568;
}

/// Lengths and distances of copies are coded alike.
std::uint32_t read_distance(std::uint32_t symbol, BitReader& bits) {
    if (symbol < 4) return symbol + 1;
    const std::uint32_t more = (symbol - 2) / 2;
    return ((2 + symbol % 2) << more) + bits.read(more) + 1;
}

std::uint32_t blocks(std::uint32_t size, std::uint32_t block_bits) {
    return (size + (1U << block_bits) - 1) >> block_bits;
}

Status damaged() {
    return error(Code::kFormat, "webp: the file is damaged or truncated");
}

class HeadReader {
  public:
    HeadReader(Bytes stream, std::uint64_t skip_bits, DecodeBudget& budget)
        : bits_(stream, skip_bits), budget_(budget) {}

    Result<LosslessHead> read(std::uint32_t width, std::uint32_t height) {
        head_.width = width;
        SPLAT_TRY(read_transforms(height));
        SPLAT_ASSIGN(head_.cache_bits, read_cache_bits());
        if (bits_.read(1) == 1) {
            SPLAT_ASSIGN(const std::uint32_t largest, read_blocks(height));
            head_.groups = largest + 1;
        }
        SPLAT_TRY(budget_.take(head_.groups, group_bytes(head_.cache_bits),
                               "webp: groups of prefix codes"));
        for (std::uint32_t group = 0; group < head_.groups; ++group) {
            SPLAT_TRY(read_group(head_.cache_bits));
            for (const Part part : {kRed, kBlue, kAlpha})
                if (group_[part].takes_bits()) head_.only_green = false;
        }
        head_.bits = bits_.at();
        return head_;
    }

  private:
    Status read_transforms(std::uint32_t height) {
        std::uint32_t seen = 0;
        while (bits_.read(1) == 1) {
            const std::uint32_t transform = 1U << bits_.read(2);
            if ((seen & transform) != 0) return damaged();
            seen |= transform;
            if (transform == 1U << kPalette) {
                const std::uint32_t colors = 1 + bits_.read(8);
                SPLAT_TRY(read_image(colors, 1).status());
                head_.width = blocks(head_.width, colors > 16  ? 0
                                                  : colors > 4 ? 1
                                                  : colors > 2 ? 2
                                                               : 3);
            } else if (transform != 1U << kSubtractGreen) {
                SPLAT_TRY(read_blocks(height).status());
            }
        }
        head_.only_palette = seen == 1U << kPalette;
        return {};
    }

    Result<std::uint32_t> read_cache_bits() {
        if (bits_.read(1) == 0) return 0U;
        const std::uint32_t cache_bits = bits_.read(4);
        if (cache_bits < 1 || cache_bits > kMostCacheBits) return damaged();
        return cache_bits;
    }

    Status read_group(std::uint32_t cache_bits) {
        for (std::size_t part = kGreen; part < kParts; ++part)
            if (!group_[part].read_code(bits_, symbols_of(part, cache_bits))) return damaged();
        return {};
    }

    /// An image of a pixel for each block.
    Result<std::uint32_t> read_blocks(std::uint32_t height) {
        const std::uint32_t block_bits = 2 + bits_.read(3);
        return read_image(blocks(head_.width, block_bits), blocks(height, block_bits));
    }

    /// An image without transforms, of one group. Returns the largest number that red and green are together, in
    /// an entropy image that of a group; a copy and a colour of the cache repeat an earlier one.
    Result<std::uint32_t> read_image(std::uint32_t width, std::uint32_t height) {
        constexpr std::uint64_t kPixelBytes = 4;  ///< in libwebp's copy
        const std::uint64_t count = std::uint64_t{width} * height;
        SPLAT_TRY(budget_.take(count, kPixelBytes, "webp: blocks of a transform or of codes"));
        SPLAT_ASSIGN(const std::uint32_t cache_bits, read_cache_bits());
        SPLAT_TRY(read_group(cache_bits));
        std::uint32_t largest = 0;
        for (std::uint64_t at = 0; at < count;) {
            const std::uint32_t green = group_[kGreen].read(bits_);
            std::uint32_t length = 1;
            if (green < kLiterals) {
                const std::uint32_t red = group_[kRed].read(bits_);
                for (const Part part : {kBlue, kAlpha}) group_[part].read(bits_);
                largest = std::max(largest, red << 8U | green);
            } else if (green < kLiterals + kLengths) {
                length = read_distance(green - kLiterals, bits_);
                read_distance(group_[kDistance].read(bits_), bits_);
            }
            if (bits_.past_end() || length > count - at) return damaged();
            at += length;
        }
        return largest;
    }

    BitReader bits_;
    DecodeBudget& budget_;
    LosslessHead head_;
    std::array<PrefixCode, kParts> group_;
};

}  // namespace

Result<LosslessHead> read_lossless_head(Bytes stream, std::uint64_t skip_bits, std::uint32_t width,
                                        std::uint32_t height, DecodeBudget& budget) {
    return HeadReader(stream, skip_bits, budget).read(width, height);
}

}  // namespace splat::io
