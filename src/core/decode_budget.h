#pragma once

#include <cstdint>
#include <string_view>

#include "core/status.h"

namespace splat {

/// What a file may cost the process that reads it, so that a small one cannot take all memory or hours.
struct DecodeLimits {
    std::uint64_t times_file = 64;         ///< bytes of memory for each byte of the file
    std::uint64_t besides = 64ULL << 20U;  ///< bytes on top of that
    std::uint64_t max_items = 1'000'000;   ///< tensors, and entries of archives
    std::uint32_t max_jpeg_scans = 100;    ///< scans per image

    [[nodiscard]] std::uint64_t allowed(std::uint64_t file_bytes) const;
};

/// The limits of this process; readers take them where their caller gives none. Thread-safe.
DecodeLimits decode_limits();
void set_decode_limits(const DecodeLimits& limits);

/// Counts the bytes that one file may still take. A reader asks before it allocates.
class DecodeBudget {
  public:
    explicit DecodeBudget(std::uint64_t file_bytes, const DecodeLimits& limits = decode_limits())
        : limits_(limits), file_bytes_(file_bytes), left_(limits.allowed(file_bytes)) {}

    /// Errors: kFormat, naming `what`, if fewer than count x each bytes are left.
    Status take(std::uint64_t count, std::uint64_t each, std::string_view what);

    [[nodiscard]] const DecodeLimits& limits() const { return limits_; }

  private:
    DecodeLimits limits_;
    std::uint64_t file_bytes_;
    std::uint64_t left_;
};

}  // namespace splat
