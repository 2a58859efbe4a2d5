#pragma once

#include <cstdint>
#include <string_view>
#include <utility>
#include <vector>

#include "io/bytes.h"

namespace splat::test {

/// Appends bits, the lowest first.
class BitWriter {
  public:
    void put(std::uint32_t value, std::uint32_t count);
    /// A prefix code of one symbol, 0 to 255, that takes no bits.
    void put_single(std::uint32_t symbol);
    [[nodiscard]] std::uint64_t count() const { return count_; }
    [[nodiscard]] const io::Buffer& bytes() const { return bytes_; }

  private:
    io::Buffer bytes_;
    std::uint64_t count_ = 0;
};

/// What precedes the stream of a lossless image.
void put_vp8l_header(BitWriter& to, std::uint32_t width, std::uint32_t height);

/// Prefix codes of green: of one symbol, which takes no bits, or of 2,048 symbols of 11 bits, told in 61 bits.
enum class Codes { kSmall, kLarge };

/// The stream of columns x rows blocks of 4 x 4 pixels, at most 65,536 blocks, each with a group of prefix codes of
/// its own. Every pixel is 0.
void put_vp8l_groups(BitWriter& to, std::uint32_t columns, std::uint32_t rows,
                     Codes codes = Codes::kSmall);

/// A WebP file of these chunks, tag and content.
io::Buffer sample_webp(const std::vector<std::pair<std::string_view, io::Bytes>>& chunks);

io::Buffer sample_webp_groups(std::uint32_t columns, std::uint32_t rows,
                              Codes codes = Codes::kSmall);

/// Lossless, 16383 x 16383, five codes of one symbol: no bits for any pixel.
io::Buffer sample_webp_of_many_pixels();

/// A lossy file with alpha from the chunks of one without.
io::Buffer with_webp_alpha(io::Bytes lossy, std::uint32_t width, std::uint32_t height,
                           io::Bytes alpha);

}  // namespace splat::test
