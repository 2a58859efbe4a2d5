#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

namespace vkrun {

/// The hash of FIPS 180-4.
class Sha256 {
  public:
    void add(const void* data, std::size_t bytes);

    /// Returns the hash of all that was added, as 64 hexadecimal digits. Nothing may be added afterwards.
    std::string text();

  private:
    void take_block(const std::uint8_t* block);

    static constexpr std::size_t kBlock = 64;
    std::array<std::uint32_t, 8> state_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                        0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
    std::array<std::uint8_t, kBlock> rest_{};
    std::uint64_t bytes_ = 0;
};

/// Returns the hash of a file. Throws a Failure of bad data if it cannot be read to its end.
std::string sha256_of_file(const std::string& path);

}  // namespace vkrun
